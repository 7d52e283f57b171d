// SPDX-License-Identifier: Apache-2.0
// The rig's whole session on frames of 1280 x 720 at 30 a second, without their decoding: what it takes of a core, what
// memory it needs beside the frames, whether it keeps up and whether it grows: in one pass without end, and from scan
// to scan.
//
//   daemon_bench DATA SPOOL [SECONDS [SCANS]]    DATA: folder of captures; SPOOL: emptied; default 600 seconds, 15
//   scans
#include "common/metrics/process_usage.h"
#include "common/video/frame_source.h"
#include "device/session/live_session.h"

#include <malloc.h>
#include <atomic>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

namespace {

namespace fs = std::filesystem;
using namespace gyre;
using Clock = std::chrono::steady_clock;

constexpr double fps = 30.0;

void line(const char* metric, double value, const char* unit) {
  std::printf(
      "%s\n",
      nlohmann::json{{"bench", "device"}, {"case", "daemon"}, {"metric", metric}, {"value", value}, {"unit", unit}}
          .dump()
          .c_str());
  std::fflush(stdout);
}

struct Moment {
  cv::Mat image;
  std::string jpeg;
};

// Frames of a recording, 1280 x 720, as a USB camera would give them.
Result<std::vector<Moment>> moments_of(const fs::path& video) {
  constexpr std::size_t wanted = 40;
  Result<std::unique_ptr<FrameSource>> source = open_capture(video);
  if (!source) return tl::unexpected(source.error());
  std::vector<Moment> moments;
  while (moments.size() < wanted) {
    Result<std::optional<Frame>> frame = (*source)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    Moment& moment = moments.emplace_back();
    const cv::Mat& image = (*frame)->image;
    // An upright recording lies down, so that all of it is used.
    cv::Mat lying = image;
    if (image.rows > image.cols) cv::rotate(image, lying, cv::ROTATE_90_CLOCKWISE);
    cv::resize(lying, moment.image, {1280, 720}, 0, 0, cv::INTER_AREA);
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", moment.image, bytes);
    moment.jpeg.assign(bytes.begin(), bytes.end());
  }
  return moments;
}

// Plays them forth and back at their pace; a frame that is not asked for in time is missed, as with a real camera.
class LoopingCamera : public CameraDevice {
 public:
  explicit LoopingCamera(const std::vector<Moment>& moments, std::atomic<std::int64_t>& missed)
      : moments_(moments), missed_(missed) {
    info_ = {.name = "loop", .width = 1280, .height = 720, .fps = fps, .live = true};
  }
  const CameraInfo& info() const override { return info_; }
  Result<void> start() override {
    begun_ = Clock::now();
    taken_ = -1;
    index_ = 0;
    return {};
  }
  void stop() override { begun_.reset(); }
  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    constexpr std::int64_t buffers = 4;
    const auto limit = Clock::now() + timeout;
    const std::int64_t newest = moment_at(Clock::now());
    std::int64_t wanted = taken_ + 1;
    if (taken_ >= 0 && newest - wanted >= buffers) {
      missed_ += newest - buffers + 1 - wanted;
      wanted = newest - buffers + 1;
    }
    const auto due = *begun_ + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(static_cast<double>(wanted) / fps));
    std::this_thread::sleep_until(std::min(due, limit));
    if (due > limit) return CameraEvent{};
    taken_ = wanted;
    const auto around = static_cast<std::int64_t>(2 * moments_.size() - 2);
    const std::int64_t at = wanted % around;
    const Moment& moment = moments_[static_cast<std::size_t>(std::min(at, around - at))];
    Frame frame;
    frame.index = index_++;
    frame.time = static_cast<double>(wanted) / fps;
    frame.image = moment.image;
    frame.jpeg = moment.jpeg;
    return CameraEvent{CameraEvent::Kind::frame, std::move(frame)};
  }

 private:
  std::int64_t moment_at(Clock::time_point now) const {
    return static_cast<std::int64_t>(std::chrono::duration<double>(now - *begun_).count() * fps);
  }

  const std::vector<Moment>& moments_;
  std::atomic<std::int64_t>& missed_;
  CameraInfo info_;
  std::optional<Clock::time_point> begun_;
  std::int64_t taken_ = -1;
  int index_ = 0;
};

// The most of a figure, and how much of it came after an early part.
class Growth {
 public:
  void add(double now, bool is_early) {
    most_ = std::max(most_, now);
    if (is_early) early_ = most_;
  }
  double most() const { return most_; }
  double later() const { return most_ - early_; }

 private:
  double most_ = 0.0, early_ = 0.0;
};

double resident_mib() {
  return resident_bytes() / (1 << 20);
}

// What the program asked for and did not give back yet; the rest of its memory is kept for what comes.
double allocated_mib() {
  const struct mallinfo2 heap = ::mallinfo2();
  return static_cast<double>(heap.uordblks + heap.hblkhd) / (1 << 20);
}

// Looks often: a frame's own needs come and go within milliseconds, and both parts have to have seen their most.
struct MemoryWatch {
  Growth resident, allocated;

  void look(bool is_early) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    resident.add(resident_mib(), is_early);
    allocated.add(allocated_mib(), is_early);
  }
};

void wait_for(const LiveSession& session, const std::function<bool(const LiveStatus&)>& is_so) {
  while (!is_so(session.status())) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

// A day's work, shortened: scans of two passes, one after the other.
void scan_after_scan(LiveSession& session, int scans) {
  constexpr int frames = 240;  // a pass
  MemoryWatch memory;
  for (int scan = 0; scan < scans; ++scan) {
    for (const SessionState after : {SessionState::between_passes, SessionState::idle}) {
      session.post({OperatorCommand::Kind::start, std::nullopt});
      const auto is_recorded = [](const LiveStatus& now) {
        return now.state == SessionState::pass && now.frames >= frames;
      };
      while (!is_recorded(session.status())) memory.look(3 * scan < scans);
      session.post({OperatorCommand::Kind::stop, std::nullopt});
      wait_for(session, [&](const LiveStatus& now) { return now.state == after; });
    }
  }
  line("scans", scans, "scans");
  line("memory_growth_by_scans", memory.resident.later(), "MiB from the first third on");
  line("allocated_growth_by_scans", memory.allocated.later(), "MiB from the first third on");
}

int bench(const fs::path& data, const fs::path& folder, double seconds, int scans) {
  const Result<std::vector<Moment>> moments = moments_of(data / "synthetic-a" / "orbit-body" / "video.mp4");
  if (!moments) {
    std::fprintf(stderr, "daemon_bench: %s\n", moments.error().message().c_str());
    return 1;
  }
  fs::remove_all(folder);
  Result<std::unique_ptr<Spool>> spool = Spool::open(folder);
  if (!spool) {
    std::fprintf(stderr, "daemon_bench: %s\n", spool.error().message().c_str());
    return 1;
  }
  const double frames_mib = resident_mib();  // with all the program's code
  std::atomic<std::int64_t> missed{0};
  LiveSession::Cameras cameras;
  cameras[""] = [&]() -> Result<std::unique_ptr<CameraDevice>> {
    return std::make_unique<LoopingCamera>(*moments, missed);
  };
  LiveSessionOptions options;
  options.settle = std::chrono::milliseconds(100);
  LiveSession session(std::move(cameras), **spool, folder, nullptr, options);
  std::thread daemon([&] {
    if (const Result<SessionEnd> end = session.run(); !end) {
      std::fprintf(stderr, "daemon_bench: %s\n", end.error().message().c_str());
    }
  });
  session.post({OperatorCommand::Kind::start, std::nullopt});
  wait_for(session, [](const LiveStatus& now) { return now.state == SessionState::pass; });

  const auto begun = Clock::now();
  const double cpu = processor_seconds();
  const std::int64_t missed_before = missed;
  const int frames_before = session.status().frames;
  const auto passed = [&] { return std::chrono::duration<double>(Clock::now() - begun).count(); };
  MemoryWatch memory;
  Growth second_half;
  while (passed() < seconds) {
    memory.look(passed() <= 0.25 * seconds);
    second_half.add(memory.resident.most(), passed() <= 0.5 * seconds);
  }
  const double took = passed();
  line("core", 100.0 * (processor_seconds() - cpu) / took, "% of a core");
  line("frames_per_second", (session.status().frames - frames_before) / took, "frames/s");
  line("frames_missed", static_cast<double>(missed - missed_before), "frames");
  line("memory", memory.resident.most() - frames_mib, "MiB beside code and decoded frames");
  line("memory_growth", memory.resident.later(), "MiB from the first quarter on");
  line("memory_growth_in_second_half", second_half.later(), "MiB");
  line("allocated_growth", memory.allocated.later(), "MiB from the first quarter on");
  line("seconds", took, "s");
  session.post({OperatorCommand::Kind::stop, std::nullopt});
  wait_for(session, [](const LiveStatus& now) { return now.state == SessionState::between_passes; });
  session.post({OperatorCommand::Kind::cancel, std::nullopt});  // the head pass
  wait_for(session, [](const LiveStatus& now) { return now.state == SessionState::idle; });
  scan_after_scan(session, scans);
  session.stop();
  daemon.join();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: daemon_bench DATA SPOOL [SECONDS [SCANS]]\n", stderr);
    return 2;
  }
  constexpr double usual_seconds = 600.0;
  constexpr int usual_scans = 15;
  return bench(argv[1], argv[2], argc > 3 ? std::atof(argv[3]) : usual_seconds,
               argc > 4 ? std::atoi(argv[4]) : usual_scans);
}
