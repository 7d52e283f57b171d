// SPDX-License-Identifier: Apache-2.0
// Serves the rig's page with a scan that plays by itself, to be looked at and measured in a browser:
//
//   page_player SPOOL PORT [AVATAR.glb]
//
// Commands of the page are obeyed. Lines of standard input set what is shown: STATE [CONDITION ...]. Standard output
// tells when each preview picture was taken: its number and milliseconds since 1970.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/http/token.h"
#include "common/log/utc_time.h"
#include "device/page/device_page.h"

#include <poll.h>
#include <unistd.h>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace gyre {
namespace {

// A person's outline in front of a wall that goes by.
cv::Mat picture_at(double seconds, int number) {
  cv::Mat image(640, 360, CV_8UC3, cv::Scalar(120, 110, 100));
  for (int i = -1; i < 9; ++i) {
    const int x = static_cast<int>(60 * i + std::fmod(80 * seconds, 60));
    cv::rectangle(image, {x, 0, 26, 640}, {96, 100, 118}, cv::FILLED);
  }
  const cv::Scalar skin(150, 175, 225), shirt(170, 90, 60), trousers(80, 60, 50);
  cv::circle(image, {180, 120}, 42, skin, cv::FILLED, cv::LINE_AA);
  cv::rectangle(image, {130, 165, 100, 190}, shirt, cv::FILLED);
  cv::line(image, {135, 180}, {70, 330}, shirt, 30, cv::LINE_AA);
  cv::line(image, {225, 180}, {290, 330}, shirt, 30, cv::LINE_AA);
  cv::line(image, {155, 355}, {140, 590}, trousers, 42, cv::LINE_AA);
  cv::line(image, {205, 355}, {220, 590}, trousers, 42, cv::LINE_AA);
  cv::putText(image, std::to_string(number), {12, 628}, cv::FONT_HERSHEY_SIMPLEX, 0.8, {255, 255, 255}, 2);
  return image;
}

SessionState state_named(const std::string& name) {
  for (int i = 0; i < session_state_count; ++i) {
    if (name_of(static_cast<SessionState>(i)) == name) return static_cast<SessionState>(i);
  }
  return SessionState::idle;
}

class Player {
 public:
  explicit Player(Spool& spool) : spool_(spool) {
    status_.host = {.is_wanted = true, .is_connected = true, .text = "workstation"};
  }

  Result<void> obey(const OperatorCommand& command) {
    const std::scoped_lock lock(mutex_);
    const SessionStep step = next_step(status_.state, event_of(command.kind, status_.state), {.has_pass = passes_ > 0});
    if (step.to == SessionState::arming) status_.pass = passes_ == 0 ? "body" : "head";
    if (step.to == SessionState::idle) passes_ = 0;
    status_.state = step.to;
    since_ = seconds_;
    return {};
  }

  // "pass too_fast host_gone"
  void read(const std::string& line) {
    const std::scoped_lock lock(mutex_);
    std::istringstream words(line);
    std::string word;
    words >> word;
    status_.state = state_named(word);
    if (status_.state == SessionState::idle) passes_ = 0;
    status_.conditions.reset();
    while (words >> word) {
      for (std::size_t i = 0; i < condition_count; ++i) {
        if (name_of(static_cast<Condition>(i)) == word) status_.conditions.set(i);
      }
      if (word == "head") status_.pass = "head";
      if (word == "body") status_.pass = "body";
    }
    since_ = seconds_;
  }

  LiveStatus at(double seconds) {
    const std::scoped_lock lock(mutex_);
    seconds_ = seconds;
    const double in_state = seconds - since_;
    if (status_.state == SessionState::arming && in_state > 1.0) enter(SessionState::pass);
    if (status_.state == SessionState::finishing && in_state > 1.5) {
      enter(++passes_ < 2 ? SessionState::between_passes : SessionState::waiting_for_host);
    }
    if (status_.state == SessionState::idle) status_.pass = "body";
    if (status_.state == SessionState::between_passes) status_.pass = "head";
    if (status_.state == SessionState::pass) walk(in_state);
    status_.host.stage = status_.state == SessionState::waiting_for_host ? "cloud" : "";
    status_.host.fraction = std::min(1.0, in_state / 20.0);
    status_.fault = status_.state == SessionState::fault ? "the camera is gone; check its plug" : "";
    const std::vector<std::string> ids = spool_.scan_ids();
    status_.scan = ids.empty() ? "" : ids.back();
    status_.frames_per_second = 29.97;
    status_.disk_free_mib = 12700;
    status_.signal = signal();
    return status_;
  }

 private:
  void enter(SessionState state) {
    status_.state = state;
    since_ = seconds_;
  }

  Signal signal() const {
    for (std::size_t i = 0; i < condition_count; ++i) {
      if (status_.conditions[i]) return signal_of(static_cast<Condition>(i));
    }
    if (status_.state == SessionState::pass) {
      return {Colour::green, Pattern::slow_blink, Tone::none, "Recording: walk on around the person."};
    }
    if (status_.state == SessionState::fault) return signal_of(Condition::camera_lost);
    return {Colour::white, Pattern::steady, Tone::none, "Ready: press the button to start."};
  }

  void walk(double seconds) {
    ++status_.frames;
    status_.azimuth = 0.3 * seconds;
    const std::vector<Band> bands = bands_of(status_.pass);
    status_.band = bands[static_cast<std::size_t>(*status_.azimuth / (2 * M_PI)) % bands.size()];
    const auto sector = static_cast<std::size_t>(CoverageMap::sector_of(*status_.azimuth));
    status_.cells[static_cast<std::size_t>(status_.band)][sector] = {true, sector % 5 != 3,
                                                                     0.35 + 0.1 * static_cast<double>(sector % 7)};
    status_.keyframes = status_.frames / 9;
    status_.acknowledged = status_.frames / 10;
  }

  Spool& spool_;
  std::mutex mutex_;
  LiveStatus status_;
  double seconds_ = 0.0, since_ = 0.0;
  int passes_ = 0;
};

// A scan whose avatar came back.
Result<void> add_finished_scan(Spool& spool, const std::filesystem::path& avatar) {
  Scan scan;
  scan.id = new_ulid();
  scan.created = utc_now();
  scan.passes = {{.name = "body", .fps = 30, .frame_count = 3, .width = 360, .height = 640}};
  if (const Result<void> opened = spool.open_scan(scan); !opened) return opened;
  std::vector<FrameRecord> records;
  for (int i = 0; i < 3; ++i) {
    std::vector<unsigned char> jpeg;
    cv::imencode(".jpg", picture_at(i, i), jpeg);
    if (const auto added = spool.add_file(scan.id, "frames/" + frame_name("body", i), std::as_bytes(std::span(jpeg)));
        !added)
      return added;
    records.push_back({.pass = "body", .index = i, .decision = "keyframe", .reason = "sharpest"});
  }
  if (const Result<void> closed = spool.close_scan(scan, records); !closed) return closed;
  const std::optional<SpooledScan> spooled = spool.scan(scan.id);
  for (const SpooledFile& file : spooled->files) {
    if (const auto stored = spool.acknowledge_file(scan.id, file.name, file.sha256); !stored) return stored;
  }
  if (const Result<void> all = spool.acknowledge_scan(scan.id); !all) return all;
  const Result<std::string> bytes = read_file(avatar);
  if (!bytes) return tl::unexpected(bytes.error());
  const std::filesystem::path came = spool.bundle(scan.id).root() / "avatar.part";
  if (const Result<void> written = write_file(came, *bytes); !written) return written;
  const Result<std::string> hash = sha256_of_file(came);
  if (!hash) return tl::unexpected(hash.error());
  if (const auto added = spool.add_result(scan.id, {"avatar.glb", bytes->size(), *hash}, came); !added) return added;
  return spool.deliver_scan(scan.id);
}

Result<void> play(const std::filesystem::path& folder, int port, const std::string& avatar) {
  const Result<std::unique_ptr<Spool>> spool = Spool::open(folder, 0);
  if (!spool) return tl::unexpected(spool.error());
  if (!avatar.empty()) {
    if (const Result<void> added = add_finished_scan(**spool, avatar); !added) return added;
  }
  Player player(**spool);
  HttpOptions http;
  http.address = "0.0.0.0";
  http.port = port;
  http.token = new_token();
  DevicePage page(http, **spool, [&](const OperatorCommand& command) { return player.obey(command); });
  if (const Result<void> started = page.start(); !started) return started;
  std::printf("%s\n", page.url().c_str());
  const auto begin = std::chrono::steady_clock::now();
  auto next = begin;
  for (int number = 0;; next += std::chrono::microseconds(33'333)) {
    std::this_thread::sleep_until(next);
    const double seconds = std::chrono::duration<double>(next - begin).count();
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 0) > 0) {
      std::string line;
      if (!std::getline(std::cin, line)) return {};
      player.read(line);
    }
    page.show(player.at(seconds));
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    page.preview(picture_at(seconds, ++number));
    std::printf("%d %lld\n", number,
                static_cast<long long>(std::chrono::duration_cast<std::chrono::milliseconds>(now).count()));
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const gyre::Result<void> played = gyre::play(argv[1], std::atoi(argv[2]), argc > 3 ? argv[3] : "");
  if (!played) std::fprintf(stderr, "%s\n", played.error().message().c_str());
  return played ? 0 : 1;
}
