// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "common/keys/keys.h"
#include "common/log/log.h"
#include "device/camera/camera_device.h"
#include "device/session/record_scan.h"
#include "device/session/unfinished.h"
#include "device/spool/spool.h"
#include "device/uplink/uplink.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ScanFlags {
  std::string body;  // camera names
  std::string head;
  std::string host;
  std::string spool = (data_folder() / "spool").string();
  std::string keys = (data_folder() / "keys").string();
  std::string host_key;
  std::string name = default_device_name();
  std::string pace = "fast";
  std::string out;
  double height_mm = 0.0;
  double patience_s = 60.0;
  double bandwidth_mbit = 0.0;
};

// What makes two calls the same scan.
std::string request_of(const ScanFlags& given) {
  return json{{"body", given.body}, {"head", given.head}, {"height_mm", given.height_mm}, {"name", given.name}}.dump();
}

Result<UplinkOptions> uplink_options(const ScanFlags& given) {
  UplinkOptions options;
  options.host = given.host;
  options.device_name = given.name;
  options.limit_bytes_per_s = given.bandwidth_mbit * 1e6 / 8.0;
  const Result<KeyPair> keys = read_or_make_key_pair(device_key(given.keys));
  if (!keys) return tl::unexpected(keys.error());
  options.keys = *keys;
  const fs::path file = given.host_key.empty() ? host_key(given.keys) : fs::path(given.host_key);
  const Result<std::string> host = read_public_key(file);
  if (!host) {
    Error error = host.error();
    error.remedy = "pair with the host first: gyre-device pair --host-public-key KEY";
    return tl::unexpected(error);
  }
  options.host_public_key = *host;
  if (const Result<void> valid = options.check(); !valid) return tl::unexpected(valid.error());
  return options;
}

// Waits until the results of a scan are here. progress: shown to the operator.
Result<void> wait_for(Uplink& uplink, const std::string& scan, double patience_s) {
  ResultWait wait;
  wait.unreachable = std::chrono::milliseconds(std::lround(1000.0 * patience_s));
  const Progress show = terminal_progress("host");
  return uplink.wait_for_result(scan, wait, [&](const ScanProgress& now) {
    show(now.fraction, now.text.empty() ? now.stage : now.stage + ": " + now.text);
  });
}

// Copies what came back from the host to the folder the operator asked for.
Result<void> hand_out(const SpooledScan& scan, const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to, error);
  if (error) return fail("cannot create the folder", to.string() + " (" + error.message() + ")");
  for (const SpooledFile& result : scan.results) {
    const Result<std::string> bytes = read_file(from / result.name);
    if (!bytes) return tl::unexpected(bytes.error());
    if (const Result<void> written = write_file(to / result.name, *bytes); !written) return written;
  }
  return {};
}

Result<std::vector<std::unique_ptr<CameraDevice>>> open_cameras(const ScanFlags& given, std::vector<PassPlan>& passes) {
  const Pace pace = given.pace == "recorded" ? Pace::recorded : Pace::fast;
  std::vector<std::unique_ptr<CameraDevice>> cameras;
  const auto open = [&](const std::string& pass, const std::string& camera) -> Result<void> {
    Result<std::unique_ptr<CameraDevice>> opened = open_camera(camera, pace);
    if (!opened) return tl::unexpected(opened.error());
    cameras.push_back(std::move(*opened));
    passes.push_back({pass, cameras.back().get()});
    return {};
  };
  if (const Result<void> body = open("body", given.body); !body) return tl::unexpected(body.error());
  if (given.head.empty()) return cameras;
  if (const Result<void> head = open("head", given.head); !head) return tl::unexpected(head.error());
  return cameras;
}

Result<json> make_scan(const ScanFlags& given, Spool& spool, Uplink* uplink) {
  std::vector<PassPlan> passes;
  const Result<std::vector<std::unique_ptr<CameraDevice>>> cameras = open_cameras(given, passes);
  if (!cameras) return tl::unexpected(cameras.error());
  if (given.height_mm == 0.0) spdlog::warn("no --height-mm: the avatar's scale will assume a mean stature");
  const std::string request = request_of(given);
  const Result<UnfinishedScan> begun = begin_scan(given.spool, request);
  if (!begun) return tl::unexpected(begun.error());
  spdlog::info("scan {}: {}", begun->id, begun->resumed ? "goes on" : "starts");

  Scan scan;
  scan.id = begun->id;
  scan.created = begun->created;
  scan.device = given.name;
  scan.software = GYRE_VERSION;
  if (given.height_mm > 0.0) scan.height_mm = given.height_mm;
  const Result<RecordingSummary> recorded = record_scan(spool, scan, passes, terminal_progress("recording"));
  if (!recorded) return tl::unexpected(recorded.error());

  json line = {{"scan", scan.id}, {"avatar", nullptr}};
  if (uplink != nullptr) {
    const Result<void> came = wait_for(*uplink, scan.id, given.patience_s);
    if (!came) {
      if (spool.phase(scan.id) == SpoolPhase::failed) end_scan(given.spool, request);
      return tl::unexpected(came.error());
    }
  }
  const std::optional<SpooledScan> spooled = spool.scan(scan.id);
  if (!spooled) return fail("the scan is gone from the spool", scan.id);
  const fs::path root = spool.bundle(scan.id).root();
  if (uplink != nullptr) {
    if (!given.out.empty()) {
      if (const Result<void> copied = hand_out(*spooled, root, given.out); !copied) {
        return tl::unexpected(copied.error());
      }
    }
    line["avatar"] = fs::absolute((given.out.empty() ? root : fs::path(given.out)) / "avatar.glb").string();
  }
  const Result<std::vector<FrameId>> keyframes = list_frames(spool.bundle(scan.id));
  if (!keyframes) return tl::unexpected(keyframes.error());
  const auto share = [&](int count) {
    return recorded->keyframes > 0 ? json(static_cast<double>(count) / recorded->keyframes) : json();
  };
  line["keyframes"] = keyframes->size();
  line["sent_before_stop"] = share(recorded->early_keyframes);
  line["spooled_before_stop"] = share(recorded->early_proposed);
  line["discarded"] = recorded->discarded;
  line["resumed"] = begun->resumed;
  end_scan(given.spool, request);
  return line;
}

// Waits for the results of every scan that is closed and not done.
Result<json> send_rest(const ScanFlags& given, Spool& spool, Uplink& uplink) {
  json done = json::array();
  for (const std::string& id : spool.scan_ids()) {
    const std::optional<SpoolPhase> phase = spool.phase(id);
    if (phase != SpoolPhase::closed && phase != SpoolPhase::acknowledged) continue;
    if (const Result<void> came = wait_for(uplink, id, given.patience_s); !came) return tl::unexpected(came.error());
    done.push_back(id);
  }
  return json{{"delivered", done}};
}

int scan(const ScanFlags& given) {
  const Result<std::unique_ptr<Spool>> spool = Spool::open(given.spool);
  if (!spool) return report_error(spool.error());
  std::unique_ptr<Uplink> uplink;
  if (!given.host.empty()) {
    const Result<UplinkOptions> options = uplink_options(given);
    if (!options) return report_error(options.error());
    uplink = std::make_unique<Uplink>(*options, **spool);
  }
  if (given.body.empty() && !uplink) {
    return report_error(wrong_use("nothing to do", "", "give a camera, a host or both").value());
  }
  const Result<json> line =
      given.body.empty() ? send_rest(given, **spool, *uplink) : make_scan(given, **spool, uplink.get());
  if (!line) return report_error(line.error());
  std::printf("%s\n", line->dump().c_str());
  return 0;
}

void add_scan_flags(CLI::App& verb, ScanFlags& flags) {
  verb.add_option("--host", flags.host, "the host, tcp://ADDRESS:PORT; default: none, the scan stays here");
  verb.add_option("--spool", flags.spool, "folder where scans are kept")->capture_default_str();
  verb.add_option("--keys", flags.keys, "folder of this device's keys, made when missing")->capture_default_str();
  verb.add_option("--host-key", flags.host_key, "file with the host's public key; default: host.pub among the keys");
  verb.add_option("--height-mm", flags.height_mm, "stature of the subject, millimetres; 0: not known")
      ->check(CLI::Range(0.0, 3000.0))
      ->capture_default_str();
  verb.add_option("--name", flags.name, "what this device calls itself")->capture_default_str();
  verb.add_option("--pace", flags.pace, "replay at the recorded pace, or as fast as possible")
      ->check(CLI::IsMember({"recorded", "fast"}))
      ->capture_default_str();
  verb.add_option("--out", flags.out, "folder that also gets what the host sends back; default: none");
  verb.add_option("--bandwidth-mbit", flags.bandwidth_mbit, "what sending may take of the line, Mbit/s; 0: all of it")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  verb.add_option("--patience-s", flags.patience_s, "how long to wait for a host that does not answer, seconds")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
}

}  // namespace

void add_replay_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<ScanFlags>();
  CLI::App* verb = app.add_subcommand("replay", "make a scan from recordings instead of a camera");
  verb->add_option("CAPTURE", flags->body, "video or folder of pictures of the whole body")->required();
  verb->add_option("--head", flags->head, "video or folder of pictures of the head; default: no head pass");
  add_scan_flags(*verb, *flags);
  verb->callback([flags, &run] {
    run = [flags] {
      ScanFlags given = *flags;
      given.body = "replay:" + fs::absolute(flags->body).lexically_normal().string();
      if (!flags->head.empty()) given.head = "replay:" + fs::absolute(flags->head).lexically_normal().string();
      return scan(given);
    };
  });
}

void add_run_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<ScanFlags>();
  flags->pace = "recorded";
  CLI::App* verb = app.add_subcommand("run", "make a scan with a camera, or send what is left without one");
  verb->add_option("--camera", flags->body, "camera of the body pass, replay:PATH; default: none, only send");
  verb->add_option("--head-camera", flags->head, "camera of the head pass, replay:PATH; default: no head pass");
  add_scan_flags(*verb, *flags);
  verb->callback([flags, &run] { run = [flags] { return scan(*flags); }; });
}

}  // namespace gyre
