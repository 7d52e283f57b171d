// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"
#include "offload/ingest/ingest_server.h"
#include "offload/orbit.h"
#include "offload/store/store.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

struct ServeFlags {
  std::string store;
  std::string endpoint = "tcp://*:7410";
  std::string key;
  std::string allow;
  double reserve_gib = 1.0;
  PipelineFlags flags;
};

// Takes queued jobs one after the other until it is stopped. A job that was interrupted is queued again when the store
// is opened the next time, and the pipeline resumes at the stage it was in.
class JobLoop {
 public:
  JobLoop(Store& store, PipelineFlags flags) : store_(store), flags_(std::move(flags)) {}

  void start(IngestServer& server) {
    server_ = &server;
    thread_ = std::thread([this] { run(); });
  }
  void wake() {
    const std::scoped_lock lock(mutex_);
    woken_ = true;
    wakeup_.notify_one();
  }
  void stop() {
    cancel_ = true;
    wake();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    while (!cancel_) {
      const Result<std::optional<std::string>> job = store_.take_job();
      if (!job) spdlog::error("{}", job.error().message());
      if (job && job->has_value()) {
        work(**job);
        continue;
      }
      std::unique_lock lock(mutex_);
      wakeup_.wait(lock, [this] { return woken_ || cancel_; });
      woken_ = false;
    }
  }

  void work(const std::string& id) {
    spdlog::info("scan {}: reconstruction starts", id);
    const Result<void> done = reconstruct(id);
    if (cancel_) return;  // still "running" in the catalogue: it continues with the next start
    if (!done) {
      spdlog::error("scan {}: {}", id, done.error().message());
      log_failure(server_->publish_failure(id, done.error().message()));
      return;
    }
    spdlog::info("scan {}: avatar is ready", id);
    log_failure(server_->publish_result(id));
  }

  Result<void> reconstruct(const std::string& id) {
    const Bundle bundle = store_.bundle(id);
    const Result<Scan> scan = read_scan(bundle);
    if (!scan) return tl::unexpected(scan.error());
    const Result<PipelineOptions> options = pipeline_options(flags_, scan->height_mm);
    if (!options) return tl::unexpected(options.error());
    const auto progress = [&](const std::string& stage, double fraction, std::string_view what) {
      server_->publish_progress(id, stage, fraction, std::string(what));
    };
    const auto reports = run_pipeline(orbit_stages(), bundle, *options, progress, cancel_);
    if (!reports) return tl::unexpected(reports.error());
    return {};
  }

  static void log_failure(const Result<void>& result) {
    if (!result) spdlog::error("{}", result.error().message());
  }

  Store& store_;
  PipelineFlags flags_;
  IngestServer* server_ = nullptr;
  std::atomic<bool> cancel_{false};
  std::mutex mutex_;
  std::condition_variable wakeup_;
  bool woken_ = false;
  std::thread thread_;
};

int serve(const ServeFlags& given) {
  // Signals are waited for below; blocked here so that every thread inherits it.
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGINT);
  ::sigaddset(&signals, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  const std::filesystem::path folder = given.store;
  const Result<std::unique_ptr<Store>> store = Store::open(folder);
  if (!store) return report_error(store.error());
  IngestOptions options;
  options.endpoint = given.endpoint;
  options.allow_list = given.allow.empty() ? folder / "devices" : std::filesystem::path(given.allow);
  options.reserve_bytes = static_cast<std::uint64_t>(given.reserve_gib * (1 << 30));
  const Result<KeyPair> keys =
      read_or_make_key_pair(given.key.empty() ? folder / "host.key" : std::filesystem::path(given.key));
  if (!keys) return report_error(keys.error());
  options.keys = *keys;
  if (const Result<void> valid = options.check(); !valid) return report_error(valid.error());
  if (const Result<PipelineOptions> usable = pipeline_options(given.flags, std::nullopt); !usable)
    return report_error(usable.error());

  JobLoop jobs(**store, given.flags);
  IngestServer server(options, **store, [&](const std::string&) { jobs.wake(); });
  if (const Result<void> started = server.start(); !started) return report_error(started.error());
  jobs.start(server);
  std::printf("%s\n", nlohmann::json{{"endpoint", server.endpoint()}, {"public_key", keys->public_key}}.dump().c_str());
  std::fflush(stdout);
  spdlog::info("serving on {}", server.endpoint());

  int signal = 0;
  ::sigwait(&signals, &signal);
  spdlog::info("stopping; scans in work continue with the next start");
  jobs.stop();
  server.stop();
  return 0;
}

}  // namespace

void add_serve_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<ServeFlags>();
  CLI::App* verb = app.add_subcommand("serve", "receive scans from devices and send avatars back");
  verb->add_option("--store", flags->store, "folder of the catalogue and the scans")->required();
  verb->add_option("--endpoint", flags->endpoint, "where devices connect, tcp://ADDRESS:PORT; port 0: any free one")
      ->capture_default_str();
  verb->add_option("--key", flags->key, "file of the host's secret key, made when missing; default: STORE/host.key");
  verb->add_option("--devices", flags->allow,
                   "folder with the public keys of the devices let in; default: STORE/devices");
  verb->add_option("--reserve-gib", flags->reserve_gib, "new scans are refused when less is left on the disk, GiB")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  add_pipeline_flags(*verb, flags->flags);
  verb->callback([flags, &run] { run = [flags] { return serve(*flags); }; });
}

}  // namespace gyre
