// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "common/log/log.h"
#include "device/camera/camera_device.h"
#include "device/link_flags.h"
#include "device/recorder_flags.h"
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

struct ReplayFlags {
  std::string body;  // camera names
  std::string head;
  std::string spool = (data_folder() / "spool").string();
  LinkFlags link;
  RecorderFlags recorder;
  std::string pace = "fast";
  std::string out;
  double height_mm = 0.0;
  double patience_s = 60.0;
};

// What makes two calls the same scan.
std::string request_of(const ReplayFlags& given) {
  return json{{"body", given.body},
              {"head", given.head},
              {"height_mm", given.height_mm},
              {"name", given.link.name},
              {"flow", given.recorder.flow}}
      .dump();
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

Result<std::vector<std::unique_ptr<CameraDevice>>> open_cameras(const ReplayFlags& given,
                                                                std::vector<PassPlan>& passes) {
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

Result<json> make_scan(const ReplayFlags& given, Spool& spool, Uplink* uplink) {
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
  scan.device = given.link.name;
  scan.software = GYRE_VERSION;
  if (given.height_mm > 0.0) scan.height_mm = given.height_mm;
  const Result<RecordingSummary> recorded =
      record_scan(spool, scan, passes, recorder_options(given.recorder), terminal_progress("recording"));
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
  line["unsharp_sectors"] = recorded->unsharp_sectors;
  line["resumed"] = begun->resumed;
  end_scan(given.spool, request);
  return line;
}

int replay(const ReplayFlags& given) {
  const Result<std::unique_ptr<Spool>> spool = Spool::open(given.spool);
  if (!spool) return report_error(spool.error());
  std::unique_ptr<Uplink> uplink;
  if (!given.link.host.empty()) {
    const Result<UplinkOptions> options = uplink_options(given.link);
    if (!options) return report_error(options.error());
    uplink = std::make_unique<Uplink>(*options, **spool);
  }
  const Result<json> line = make_scan(given, **spool, uplink.get());
  if (!line) return report_error(line.error());
  std::printf("%s\n", line->dump().c_str());
  return 0;
}

}  // namespace

void add_replay_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<ReplayFlags>();
  CLI::App* verb = app.add_subcommand("replay", "make a scan from recordings instead of a camera");
  verb->add_option("CAPTURE", flags->body, "video or folder of pictures of the whole body")->required();
  verb->add_option("--head", flags->head, "video or folder of pictures of the head; default: no head pass");
  add_link_flags(*verb, flags->link);
  add_flow_flag(*verb, flags->recorder);
  verb->add_option("--spool", flags->spool, "folder where scans are kept")->capture_default_str();
  verb->add_option("--height-mm", flags->height_mm, "stature of the subject, millimetres; 0: not known")
      ->check(CLI::Range(0.0, 3000.0))
      ->capture_default_str();
  verb->add_option("--pace", flags->pace, "replay at the recorded pace, or as fast as possible")
      ->check(CLI::IsMember({"recorded", "fast"}))
      ->capture_default_str();
  verb->add_option("--out", flags->out, "folder that also gets what the host sends back; default: none");
  verb->add_option("--patience-s", flags->patience_s, "how long to wait for a host that does not answer, seconds")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  verb->callback([flags, &run] {
    run = [flags] {
      ReplayFlags given = *flags;
      given.body = "replay:" + fs::absolute(flags->body).lexically_normal().string();
      if (!flags->head.empty()) given.head = "replay:" + fs::absolute(flags->head).lexically_normal().string();
      return replay(given);
    };
  });
}

}  // namespace gyre
