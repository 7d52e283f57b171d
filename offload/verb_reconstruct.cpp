// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/bundle/ulid.h"
#include "common/log/log.h"
#include "common/log/utc_time.h"
#include "offload/ingest/recording.h"
#include "offload/orbit.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ReconstructFlags {
  std::string capture;
  std::string head;
  std::string out;
  PipelineFlags flags;
};

// What tells one recording from another without reading it.
json fingerprint(const fs::path& capture) {
  std::error_code error;
  json print = {{"path", fs::absolute(capture).lexically_normal().string()}};
  if (fs::is_directory(capture, error)) {
    std::size_t files = 0;
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(capture, error)) {
      ++files;
      if (entry.is_regular_file(error)) bytes += entry.file_size(error);
    }
    print["files"] = files;
    print["bytes"] = bytes;
  } else {
    print["bytes"] = fs::file_size(capture, error);
    print["changed"] = fs::last_write_time(capture, error).time_since_epoch().count();
  }
  return print;
}

// Copies the recorded part of a scan (not its work) into `out`.
Result<void> copy_scan(const Bundle& from, const Bundle& to) {
  if (Result<void> sound = verify_bundle(from); !sound) return sound;
  std::error_code error;
  fs::create_directories(to.root(), error);
  for (const char* name : {"frames.jsonl", "frames", "scan.json"}) {
    fs::copy(from.root() / name, to.root() / name, fs::copy_options::recursive | fs::copy_options::overwrite_existing,
             error);
    if (error)
      return fail("cannot copy the scan", (to.root() / name).string() + " (" + error.message() + ")",
                  "check the space and rights there");
  }
  return {};
}

// Selects keyframes of the recordings into a bundle. source.json is written last and marks the bundle as complete.
Result<void> extract(const std::vector<Recording>& recordings, const Bundle& bundle, const json& source) {
  std::error_code error;
  fs::remove(bundle.root() / "source.json", error);
  Scan scan;
  const Result<Scan> before = read_scan(bundle);
  scan.id = before ? before->id : new_ulid();
  scan.created = utc_now();
  scan.device = "recording";
  const std::atomic<bool> never{false};
  const Result<Scan> made = scan_of_recordings(recordings, bundle, scan, terminal_progress("keyframes"), never);
  if (!made) return tl::unexpected(made.error());
  return write_file(bundle.root() / "source.json", source.dump(2) + "\n");
}

// Brings the capture into the bundle at `out`, unless it is there already.
Result<void> prepare(const ReconstructFlags& given, const Bundle& bundle) {
  std::error_code error;
  const fs::path capture = given.capture;
  if (!fs::exists(capture, error))
    return wrong_use("no such capture", capture.string(), "give a video, a folder of pictures or a scan");
  if (!given.head.empty() && !fs::exists(given.head, error))
    return wrong_use("no such capture", given.head, "give a video or a folder of pictures");
  if (fs::exists(capture / "scan.json", error)) {
    if (!given.head.empty()) return wrong_use("--head goes with a recording", "the capture is a scan", "leave it out");
    if (fs::equivalent(capture, bundle.root(), error)) return {};
    return copy_scan(Bundle(capture), bundle);
  }
  json source = {{"body", fingerprint(capture)}};
  std::vector<Recording> recordings = {{"body", capture}};
  if (!given.head.empty()) {
    source["head"] = fingerprint(given.head);
    recordings.push_back({"head", given.head});
  }
  if (const Result<std::string> there = read_file(bundle.root() / "source.json");
      there && json::parse(*there, nullptr, false) == source)
    return {};
  if (fs::exists(bundle.root(), error) && !fs::is_empty(bundle.root(), error) &&
      !fs::exists(bundle.scan_file(), error)) {
    return wrong_use("the folder is not empty and not a scan", bundle.root().string(), "give another --out");
  }
  return extract(recordings, bundle, source);
}

json summary(const Bundle& bundle, const std::vector<StageReport>& reports, double seconds) {
  json stages = json::object();
  double peak = 0;
  for (const StageReport& r : reports) {
    stages[r.name] = {{"seconds", r.seconds},
                      {"cpu_seconds", r.cpu_seconds},
                      {"peak_memory_mib", r.peak_memory_mib},
                      {"resumed", r.resumed}};
    peak = std::max(peak, r.peak_memory_mib);
  }
  std::error_code error;
  const fs::path avatar = bundle.root() / "avatar.glb";
  return {{"avatar", fs::exists(avatar, error) ? json(avatar.string()) : json()},
          {"bundle", bundle.root().string()},
          {"seconds", seconds},
          {"peak_memory_mib", peak},
          {"stages", stages}};
}

int reconstruct(const ReconstructFlags& given) {
  const auto start = std::chrono::steady_clock::now();
  const Bundle bundle(given.out);
  if (const Result<void> ready = prepare(given, bundle); !ready) return report_error(ready.error());
  Result<Scan> scan = read_scan(bundle);
  if (!scan) return report_error(scan.error());
  if (given.flags.height_mm > 0 && scan->height_mm != given.flags.height_mm) {
    scan->height_mm = given.flags.height_mm;
    if (const Result<void> written = write_scan(bundle, *scan); !written) return report_error(written.error());
  }
  const Result<PipelineOptions> options = pipeline_options(given.flags, scan->height_mm);
  if (!options) return report_error(options.error());

  std::string current;
  Progress bar;
  const auto reports = run_pipeline(
      orbit_stages(), bundle, *options,
      [&](const std::string& stage, double fraction, std::string_view what) {
        if (stage != current) bar = terminal_progress(stage);
        current = stage;
        bar(fraction, what);
      },
      [] { return Order::go_on; });
  if (!reports) return report_error(reports.error());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%s\n", summary(bundle, *reports, seconds).dump().c_str());
  return 0;
}

}  // namespace

void add_reconstruct_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<ReconstructFlags>();
  CLI::App* verb = app.add_subcommand("reconstruct", "make an avatar of a recording, without a device");
  verb->add_option("capture", flags->capture, "a video, a folder of pictures or the folder of a scan (body pass)")
      ->required();
  verb->add_option("--head", flags->head, "recording of the head pass; default: none");
  verb->add_option("--out", flags->out, "folder for the scan and its avatar")->required();
  add_pipeline_flags(*verb, flags->flags);
  verb->callback([flags, &run] { run = [flags] { return reconstruct(*flags); }; });
}

}  // namespace gyre
