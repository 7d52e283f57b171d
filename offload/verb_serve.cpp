// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"
#include "offload/ingest/ingest_server.h"
#include "offload/orbit.h"
#include "offload/pipeline/local_executor.h"
#include "offload/pipeline/runner.h"
#include "offload/pipeline/slurm_executor.h"
#include "offload/store/store.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
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
  RunnerOptions runner;
  std::string executor = "local";
  SlurmOptions slurm;
  PipelineFlags flags;
};

std::unique_ptr<Executor> make_executor(const ServeFlags& given) {
  if (given.executor == "slurm") return std::make_unique<SlurmExecutor>(given.slurm);
  return std::make_unique<LocalExecutor>();
}

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
  events.options = [&](const Scan& scan) { return pipeline_options(given.flags, scan.height_mm); };
  runner = std::make_unique<Runner>(given.runner, **store, *executor, orbit_stages(), events);
  if (const Result<void> started = server.start(); !started) return report_error(started.error());
  runner->start();
  std::printf("%s\n", nlohmann::json{{"endpoint", server.endpoint()}, {"public_key", keys->public_key}}.dump().c_str());
  std::fflush(stdout);
  spdlog::info("serving on {}", server.endpoint());

  int signal = 0;
  ::sigwait(&signals, &signal);
  spdlog::info("stopping; scans in work continue with the next start");
  runner->stop();
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
  add_pipeline_flags(*verb, flags->flags);
  verb->callback([flags, &run] { run = [flags] { return serve(*flags); }; });
}

}  // namespace gyre
