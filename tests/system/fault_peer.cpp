// SPDX-License-Identifier: Apache-2.0
// The two ends of a fault run, each a process of its own that can be killed at any moment and started again:
//
//   fault_peer host FOLDER ENDPOINT     receives scans, makes an "avatar" of each, sends it back; says its endpoint
//   fault_peer device FOLDER ENDPOINT   records one scan after another until FOLDER/enough is there; ends when the
//                                       results of all of them have come back
//
// What a scan is made of follows from its number alone (fault_scans.h), so that nobody has to remember it.
#include "common/bundle/atomic_file.h"
#include "device/uplink/uplink.h"
#include "offload/ingest/ingest_server.h"
#include "offload/pipeline/local_executor.h"
#include "offload/pipeline/runner.h"
#include "tests/system/fault_scans.h"

#include <spdlog/spdlog.h>
#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using std::chrono::milliseconds;

[[noreturn]] void give_up(const Error& error) {
  spdlog::error("{}", error.message());
  std::_Exit(1);
}

template <class T>
T must(Result<T> result) {
  if (!result) give_up(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// A disk that is full just now is not the end.
template <class Work>
auto in_time(const Work& work) {
  constexpr int tries = 1200;
  constexpr useconds_t wait_us = 50'000;
  auto result = work();
  for (int i = 0; i < tries && !result; ++i) {
    ::usleep(wait_us);
    result = work();
  }
  return must(std::move(result));
}

Stage avatar_stage() {
  Stage stage;
  stage.name = "avatar";
  stage.inputs = {"scan.json", "frames.jsonl", "frames"};
  stage.options = json::object();
  stage.published = {"avatar.glb", "report.json"};
  stage.run = [](const StageContext& context) -> Result<json> {
    const Result<std::string> avatar = fault_avatar(context.bundle);
    if (!avatar) return tl::unexpected(avatar.error());
    if (Result<void> done = write_file(context.out / "avatar.glb", *avatar); !done) return tl::unexpected(done.error());
    if (Result<void> done = write_file(context.out / "report.json", "{}"); !done) return tl::unexpected(done.error());
    return json::object();
  };
  return stage;
}

tl::expected<StageOutcome, PipelineFailure> run_here(const Stage& stage, const StageContext& context, const Ask&) {
  Result<json> result = stage.run(context);
  if (result) return StageOutcome{std::move(*result), {}};
  PipelineFailure failure{result.error()};
  failure.stage = stage.name;
  return tl::unexpected(failure);
}

int host(const fs::path& folder, const std::string& endpoint) {
  const auto store = in_time([&] { return Store::open(folder / "store"); });
  IngestOptions options;
  options.endpoint = endpoint;
  options.keys = must(read_key_pair(folder / "host.key"));
  options.allow_list = folder / "devices";
  options.reserve_bytes = 1 << 20;
  must(options.check());
  std::unique_ptr<Runner> runner;
  IngestServer server(options, *store, [&](const std::string&) { runner->wake(); });
  RunnerEvents events;
  events.progress = [&](const std::string& scan, const std::string& stage, double fraction, const std::string& text) {
    server.publish_progress(scan, stage, fraction, text);
  };
  events.done = [&](const std::string& scan) { return server.publish_result(scan); };
  events.failed = [&](const std::string& scan, const std::string& reason) {
    return server.publish_failure(scan, reason);
  };
  events.options = [](const Scan&) { return PipelineOptions(); };
  RunnerOptions runner_options;
  runner_options.retry_waits = {milliseconds(50), milliseconds(200)};
  LocalExecutor executor(2, 4.0, run_here);
  runner = std::make_unique<Runner>(runner_options, *store, executor, std::vector{avatar_stage()}, events);
  in_time([&] { return server.start(); });  // the port of the one before may take a moment to become free
  runner->start();
  std::printf("%s\n", server.endpoint().c_str());
  std::fflush(stdout);
  for (;;) ::pause();
}

// Records a scan, or goes on with it.
Result<void> record(Spool& spool, int number) {
  const Scan scan = fault_scan(number);
  const std::optional<SpoolPhase> phase = spool.phase(scan.id);
  if (phase && *phase != SpoolPhase::recording) return {};
  if (Result<void> opened = spool.open_scan(scan); !opened) return opened;
  for (int i = 0; i < fault_frames; ++i) {
    if (Result<void> added = spool.add_file(scan.id, keyframe_name(i), fault_frame(number, i)); !added) return added;
    if (is_fault_keyframe(i)) continue;
    if (Result<void> dropped = spool.discard(scan.id, keyframe_name(i)); !dropped) return dropped;
  }
  return spool.close_scan(scan, small_records(fault_frames, fault_keyframes()));
}

int device(const fs::path& folder, const std::string& endpoint) {
  const auto spool = must(Spool::open(folder / "spool", 0));
  UplinkOptions options;
  options.host = endpoint;
  options.host_public_key = must(read_public_key(folder / "host.pub"));
  options.keys = must(read_key_pair(folder / "device.key"));
  options.device_name = "rig";
  options.hello_timeout = milliseconds(2000);
  options.ping_interval = milliseconds(300);
  options.silence_timeout = milliseconds(2000);
  options.reconnect_min = milliseconds(5);
  options.reconnect_max = milliseconds(200);
  options.refused_retry = milliseconds(300);
  must(options.check());
  Uplink uplink(options, *spool);
  const auto is_delivered = [&](int number) { return spool->phase(fault_scan(number).id) == SpoolPhase::delivered; };
  int begun = 0;
  while (spool->scan(fault_scan(begun).id)) ++begun;
  if (begun > 0) must(record(*spool, begun - 1));
  for (int oldest = 0;;) {
    while (oldest < begun && is_delivered(oldest)) ++oldest;
    const bool enough = fs::exists(folder / "enough");
    if (enough && oldest == begun) return 0;
    constexpr int at_once = 3;
    if (!enough && begun - oldest < at_once) {
      must(record(*spool, begun++));
      continue;
    }
    if (spool->phase(fault_scan(oldest).id) == SpoolPhase::failed) {
      give_up(fail("the host failed a scan", spool->scan(fault_scan(oldest).id)->reason).value());
    }
    constexpr useconds_t look_again_us = 2000;
    ::usleep(look_again_us);
  }
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 3 && words[0] == "host") return gyre::host(words[1], words[2]);
  if (words.size() == 3 && words[0] == "device") return gyre::device(words[1], words[2]);
  std::fputs("usage: fault_peer host|device FOLDER ENDPOINT\n", stderr);
  return 2;
}
