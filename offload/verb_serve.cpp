// SPDX-License-Identifier: Apache-2.0
#include "common/http/page_options.h"
#include "common/keys/keys.h"
#include "common/log/log_format.h"
#include "common/service/service_manager.h"
#include "offload/host_operations.h"
#include "offload/ingest/ingest_server.h"
#include "offload/orbit.h"
#include "offload/page/host_page.h"
#include "offload/page/landmark_view.h"
#include "offload/pipeline/local_executor.h"
#include "offload/pipeline/runner.h"
#include "offload/pipeline/slurm_executor.h"
#include "offload/store/receipts.h"
#include "offload/store/retention.h"
#include "offload/store/store.h"
#include "offload/verbs.h"

#include <sys/resource.h>
#include <CLI/CLI.hpp>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <thread>

namespace gyre {

namespace {

struct ServeFlags {
  std::string store;
  std::string endpoint = "tcp://*:7410";
  std::string key;
  std::string allow;
  double reserve_gib = 1.0;
  RunnerOptions runner;
  std::string executor = "local";
  SlurmOptions slurm;
  std::string page = "127.0.0.1:7480";
  double keep_days = 0;  // 0: no limit
  int keep_scans = -1;   // -1: no limit
  PipelineFlags flags;
};

std::unique_ptr<Executor> make_executor(const ServeFlags& given) {
  if (given.executor == "slurm") return std::make_unique<SlurmExecutor>(given.slurm);
  return std::make_unique<LocalExecutor>();
}

// Points that were picked on the page count as --landmarks does.
Result<PipelineOptions> options_of_scan(const ServeFlags& given, const Store& store, const Scan& scan) {
  PipelineFlags flags = given.flags;
  const std::filesystem::path picked = picked_file(store.bundle(scan.id));
  std::error_code error;
  if (std::filesystem::exists(picked, error)) flags.picked_landmarks = picked.string();
  return pipeline_options(flags, scan.height_mm);
}

RetentionPolicy retention_policy(const ServeFlags& given) {
  constexpr double hours_a_day = 24.0;
  RetentionPolicy policy;
  if (given.keep_days > 0) policy.longest = std::chrono::hours(std::lround(hours_a_day * given.keep_days));
  if (given.keep_scans >= 0) policy.most = static_cast<std::size_t>(given.keep_scans);
  return policy;
}

ScanActions page_actions(Runner& runner, const Store& store, const LinkBoard& board) {
  ScanActions actions;
  actions.devices = [&] { return board.devices(); };
  actions.work = [&] {
    std::map<std::string, ScanActivity> work;
    for (const ScanStatus& one : runner.status().value_or(std::vector<ScanStatus>())) {
      if (one.state == StorePhase::running) work[one.scan] = {one.stage, one.fraction, one.text};
    }
    return work;
  };
  actions.queued = [&](const std::string&) { runner.wake(); };
  actions.cancel = [&](const std::string& scan) { return runner.cancel(scan); };
  actions.rerun = [&](const std::string& scan, const nlohmann::json& options) { return runner.rerun(scan, options); };
  actions.remove = [&](const std::string& scan) -> Result<void> {
    const Result<DeletionReceipt> receipt = runner.delete_scan(scan);
    if (!receipt) return tl::unexpected(receipt.error());
    return keep_receipt(store.folder(), *receipt, "from the page");
  };
  return actions;
}

// Those that serve() waits for.
sigset_t awaited_signals() {
  sigset_t signals;
  ::sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2}) ::sigaddset(&signals, signal);
  return signals;
}

// Every connection takes a descriptor, those of strangers too until they are turned away; files must not run short of
// them.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

// Returns when the program is to end; changes the level of messages meanwhile.
void wait_for_the_end(const sigset_t& signals) {
  for (;;) {
    int signal = 0;
    ::sigwait(&signals, &signal);
    if (signal == SIGUSR1) change_log_level(1);
    if (signal == SIGUSR2) change_log_level(-1);
    if (signal == SIGINT || signal == SIGTERM) return;
  }
}

// Ends the program when it has not ended by itself in time. Everything that was promised to anybody is on disk then, as
// it is at any moment.
class StopLimit {
 public:
  StopLimit() : thread_([this] { watch(); }) {}
  StopLimit(const StopLimit&) = delete;
  StopLimit& operator=(const StopLimit&) = delete;
  ~StopLimit() {
    {
      const std::scoped_lock lock(mutex_);
      stopped_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }

 private:
  void watch() {
    constexpr std::chrono::milliseconds limit{4500};
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, limit, [this] { return stopped_; })) return;
    spdlog::warn("something does not stop; it is left as it is, and goes on with the next start");
    spdlog::default_logger()->flush();
    std::_Exit(0);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::thread thread_;
};

int serve(const ServeFlags& given) {
  // Signals are waited for below; blocked here so that every thread inherits it.
  const sigset_t signals = awaited_signals();
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const Result<ServiceManager> manager = ServiceManager::from_environment();
  if (!manager) return report_error(manager.error());

  raise_descriptor_limit();
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

  if (const Result<void> valid = given.runner.check(); !valid) return report_error(valid.error());
  if (const Result<void> valid = given.slurm.check(); !valid) return report_error(valid.error());
  const std::unique_ptr<Executor> executor = make_executor(given);
  std::unique_ptr<Runner> runner;
  IngestServer server(options, **store, [&](const std::string&) { runner->wake(); });
  RunnerEvents events;
  events.progress = [&](const std::string& scan, const std::string& stage, double fraction, const std::string& text) {
    server.publish_progress(scan, stage, fraction, text);
  };
  events.done = [&](const std::string& scan) { return server.publish_result(scan); };
  events.failed = [&](const std::string& scan, const std::string& reason) {
    return server.publish_failure(scan, reason);
  };
  events.options = [&](const Scan& scan) { return options_of_scan(given, **store, scan); };
  runner = std::make_unique<Runner>(given.runner, **store, *executor, orbit_stages(), events);
  if (const Result<void> started = server.start(); !started) return report_error(started.error());
  Retention retention(retention_policy(given), **store);
  const HostParts parts{**store, server, *runner, retention, options.reserve_bytes};
  Metrics metrics;
  add_host_metrics(metrics, parts);
  nlohmann::json ready = {{"endpoint", server.endpoint()}, {"public_key", keys->public_key}};
  std::unique_ptr<HostPage> page;
  if (given.page != "off") {
    const Result<HttpOptions> http = page_options(given.page, std::filesystem::path(given.store) / "page.token");
    if (!http) return report_error(http.error());
    page = std::make_unique<HostPage>(HostPageOptions{*http, options.reserve_bytes}, **store, orbit_stages(),
                                      page_actions(*runner, **store, server.board()));
    add_operations_routes(page->server(), metrics, host_health(parts));
    if (const Result<void> started = page->start(); !started) return report_error(started.error());
    ready["page"] = page->server().url();
  }
  runner->start();
  retention.start();
  std::printf("%s\n", ready.dump().c_str());
  std::fflush(stdout);
  spdlog::info("serving on {}", server.endpoint());
  if (const Result<void> told = manager->ready(); !told) spdlog::warn("{}", told.error().message());

  wait_for_the_end(signals);
  if (const Result<void> told = manager->stopping(); !told) spdlog::warn("{}", told.error().message());
  spdlog::info("stopping; scans in work continue with the next start");
  const StopLimit limit;
  // Browsers may take their time, and need nothing of the rest to end.
  std::thread browsers([&] {
    if (page) page->stop();
  });
  retention.stop();
  runner->stop();
  server.stop();
  browsers.join();
  spdlog::info("stopped");
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
  verb->add_option("--scans-at-once", flags->runner.scans_at_once, "scans worked on at the same time")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--executor", flags->executor,
                   "where stages run: local, this machine; slurm, as jobs of the cluster this machine submits to, with "
                   "the store on a folder that all its nodes share")
      ->check(CLI::IsMember({"local", "slurm"}))
      ->capture_default_str();
  verb->add_option("--slurm-partition", flags->slurm.partition, "partition of those jobs; default: the cluster's");
  verb->add_option("--slurm-cores", flags->slurm.cores, "cores of a job that can use several")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  verb->add_option("--page", flags->page,
                   "where browsers find the page, ADDRESS:PORT; off: nowhere. From another machine it takes the token "
                   "that the link printed at the start has")
      ->capture_default_str();
  verb->add_option("--keep-days", flags->keep_days,
                   "days after delivery that a scan stays, then it is deleted with a receipt; default: for ever")
      ->check(CLI::Range(0.0, 1e5));
  verb->add_option("--keep-scans", flags->keep_scans,
                   "delivered scans that stay, the newest; older ones are deleted with a receipt; default: all")
      ->check(CLI::Range(0, 1'000'000'000));
  add_pipeline_flags(*verb, flags->flags);
  verb->callback([flags, &run] { run = [flags] { return serve(*flags); }; });
}

}  // namespace gyre
