// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/runner.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/disk_space.h"
#include "common/log/utc_time.h"

#include <spdlog/spdlog.h>
#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

namespace gyre {

namespace {

using nlohmann::json;

constexpr const char* failure_file = "failure.json";
constexpr const char* cancelled_by_user = "cancelled";

// The last bytes of a log, from the start of a line on.
std::string tail(const std::string& log) {
  constexpr std::size_t kept = 4096;
  if (log.size() <= kept) return log;
  const std::size_t line = log.find('\n', log.size() - kept);
  return log.substr(line == std::string::npos ? log.size() - kept : line + 1);
}

Result<void> write_failure(const Bundle& bundle, const StoredJob& job, const PipelineFailure& failure) {
  const json report = {
      {"scan", job.scan},   {"stage", failure.stage}, {"cause", name_of(failure.cause)}, {"message", failure.message()},
      {"tries", job.tries}, {"at", utc_now()},        {"log", tail(failure.log)}};
  return write_file(bundle.root() / failure_file, report.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

// A stage that could not write gives its own reason; what it says to do, or the disk, tells the cause.
FailureCause cause_of(const PipelineFailure& failure, const Store& store) {
  constexpr std::uint64_t next_to_nothing = 16 << 20;
  const bool full = is_full_disk(failure) || free_bytes(store.folder()).value_or(next_to_nothing) < next_to_nothing;
  return failure.cause == FailureCause::stage && full ? FailureCause::space : failure.cause;
}

void log_error(const Result<void>& result) {
  if (!result) spdlog::error("{}", result.error().message());
}

}  // namespace

Result<void> RunnerOptions::check() const {
  if (scans_at_once < 1) return wrong_use("scans_at_once is less than one", std::to_string(scans_at_once));
  if (lease < std::chrono::seconds(1)) return wrong_use("a lease is shorter than a second");
  for (const auto& wait : retry_waits) {
    if (wait.count() < 0 || wait > longest_retry_wait) return wrong_use("a wait before a retry is not 0 to 10 minutes");
  }
  return {};
}

std::optional<std::chrono::milliseconds> retry_wait(const RunnerOptions& options, FailureCause cause, int tries) {
  if (cause == FailureCause::stage || cause == FailureCause::cancelled) return std::nullopt;
  const auto before = static_cast<std::size_t>(std::max(0, tries - 1));
  if (cause == FailureCause::space && !options.retry_waits.empty()) {
    return options.retry_waits[std::min(before, options.retry_waits.size() - 1)];
  }
  return before < options.retry_waits.size() ? std::optional(options.retry_waits[before]) : std::nullopt;
}

class Runner::Worker {
 public:
  Worker(RunnerOptions options, Store& store, Executor& executor, std::vector<Stage> stages, RunnerEvents events)
      : options_(std::move(options)),
        store_(store),
        executor_(executor),
        stages_(std::move(stages)),
        events_(std::move(events)) {}
  ~Worker() { stop(); }

  void start() {
    thread_ = std::thread([this] { schedule(); });
  }
  void stop();
  void wake();
  Result<std::vector<ScanStatus>> status() const;
  RunnerTally tally() const {
    const std::scoped_lock lock(mutex_);
    return tally_;
  }
  Result<void> cancel(const std::string& scan_id);
  Result<void> rerun(const std::string& scan_id, const json& changes);
  Result<DeletionReceipt> delete_scan(const std::string& scan_id);

 private:
  // A scan in work.
  struct Active {
    StoredJob job;
    std::atomic<bool> cancelled{false};
    std::atomic<bool> lost{false};  // the job was given to another
    bool ended = false;             // its thread is about to end
    std::string stage, text;
    double fraction = 0.0;
    std::thread thread;
  };

  void schedule();
  void take_jobs();
  void join_ended();
  void work(Active& active);
  ScanOutcome reconstruct(Active& active);
  void renew(Active& active, WallTime now);
  void conclude(const Active& active, const ScanOutcome& outcome);
  void try_again_or_give_up(const StoredJob& job, PipelineFailure failure);
  void give_up(const StoredJob& job, const PipelineFailure& failure);
  void count(const std::function<void(RunnerTally&)>& add);
  void count_stages(const std::vector<StageReport>& reports);
  void tell(Active& active, const std::string& stage, double fraction, std::string_view what);

  const RunnerOptions options_;
  Store& store_;
  Executor& executor_;
  const std::vector<Stage> stages_;
  const RunnerEvents events_;
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  bool woken_ = false;
  RunnerTally tally_;
  std::map<std::string, std::unique_ptr<Active>> active_;
  std::thread thread_;
};

void Runner::Worker::stop() {
  stopping_ = true;
  wake();
  if (thread_.joinable()) thread_.join();
}

void Runner::Worker::wake() {
  const std::scoped_lock lock(mutex_);
  woken_ = true;
  changed_.notify_all();
}

void Runner::Worker::schedule() {
  constexpr std::chrono::milliseconds look_again{1000};  // for jobs that become due, and leases that lapse
  while (!stopping_) {
    const Result<std::vector<std::string>> lapsed = store_.take_back_lapsed(events_.now());
    if (!lapsed) spdlog::error("{}", lapsed.error().message());
    for (const std::string& scan : lapsed.value_or(std::vector<std::string>())) {
      spdlog::warn("scan {}: its runner fell silent; it is queued again", scan);
    }
    join_ended();
    take_jobs();
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, look_again, [this] { return woken_ || stopping_; });
    woken_ = false;
  }
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] {
    return std::all_of(active_.begin(), active_.end(), [](const auto& one) { return one.second->ended; });
  });
  lock.unlock();
  join_ended();
}

void Runner::Worker::join_ended() {
  std::vector<std::unique_ptr<Active>> ended;
  {
    const std::scoped_lock lock(mutex_);
    for (auto it = active_.begin(); it != active_.end();) {
      if (!it->second->ended) {
        ++it;
        continue;
      }
      ended.push_back(std::move(it->second));
      it = active_.erase(it);
    }
    if (!ended.empty()) changed_.notify_all();
  }
  for (const auto& one : ended) one->thread.join();
}

void Runner::Worker::take_jobs() {
  while (!stopping_) {
    std::vector<std::string> in_work;  // also those taken back from a thread that fell silent and has not ended yet
    {
      const std::scoped_lock lock(mutex_);
      for (const auto& [scan, one] : active_) in_work.push_back(scan);
    }
    if (in_work.size() >= static_cast<std::size_t>(options_.scans_at_once)) return;
    const Result<std::optional<StoredJob>> job = store_.take_job(events_.now(), options_.lease, in_work);
    if (!job) spdlog::error("{}", job.error().message());
    if (!job || !*job) return;
    const std::scoped_lock lock(mutex_);
    std::unique_ptr<Active>& place = active_[(*job)->scan] = std::make_unique<Active>();
    place->job = **job;
    place->thread = std::thread([this, &one = *place] { work(one); });
  }
}

void Runner::Worker::work(Active& active) {
  spdlog::info("scan {}: reconstruction starts, try {}", active.job.scan, active.job.tries);
  conclude(active, reconstruct(active));
  const std::scoped_lock lock(mutex_);
  active.ended = true;
  woken_ = true;
  changed_.notify_all();
}

void Runner::Worker::tell(Active& active, const std::string& stage, double fraction, std::string_view what) {
  {
    const std::scoped_lock lock(mutex_);
    active.stage = stage;
    active.fraction = fraction;
    active.text = what;
  }
  events_.progress(active.job.scan, stage, fraction, std::string(what));
}

ScanOutcome Runner::Worker::reconstruct(Active& active) {
  const auto refuse = [](const Error& error) { return tl::unexpected(PipelineFailure{error}); };
  const Bundle bundle = store_.bundle(active.job.scan);
  const Result<Scan> scan = read_scan(bundle);
  if (!scan) return refuse(scan.error());
  Result<PipelineOptions> options = events_.options(*scan);
  if (!options) return refuse(options.error());
  const json asked = json::parse(active.job.options, nullptr, false);
  if (asked.is_object()) options->stage_options.merge_patch(asked);

  WallTime renewed = events_.now();
  const Ask ask = [&] {
    if (active.cancelled) return Order::cancel;
    if (stopping_ || active.lost) return Order::pause;
    constexpr int renewals_a_lease = 4;
    const WallTime now = events_.now();
    if (now < renewed || now - renewed > options_.lease / renewals_a_lease) {
      renew(active, now);
      renewed = now;
    }
    return Order::go_on;
  };
  const auto progress = [&](const std::string& stage, double fraction, std::string_view what) {
    tell(active, stage, fraction, what);
  };
  ScanOutcome outcome = executor_.run(stages_, {active.job.scan, bundle, *options}, progress, ask);
  renew(active, events_.now());
  return outcome;
}

void Runner::Worker::renew(Active& active, WallTime now) {
  const Result<bool> held = store_.renew_lease(active.job.scan, active.job.lease, now + options_.lease);
  if (!held) spdlog::error("{}", held.error().message());
  if (held && !*held) active.lost = true;
}

void Runner::Worker::conclude(const Active& active, const ScanOutcome& outcome) {
  const StoredJob& job = active.job;
  const Bundle bundle = store_.bundle(job.scan);
  if (active.cancelled) {
    spdlog::info("scan {}: cancelled", job.scan);
    count([](RunnerTally& tally) { ++tally.cancelled; });
    return log_error(events_.failed(job.scan, cancelled_by_user));
  }
  if (active.lost) return;
  if (outcome) {
    std::error_code error;
    std::filesystem::remove(bundle.root() / failure_file, error);
    if (const Result<void> done = events_.done(job.scan); !done) {
      return try_again_or_give_up(job, PipelineFailure{done.error()});
    }
    count_stages(*outcome);
    spdlog::info("scan {}: avatar is ready", job.scan);
    return;
  }
  if (stopping_ && outcome.error().cause == FailureCause::cancelled) return;  // goes on with the next start
  try_again_or_give_up(job, outcome.error());
}

void Runner::Worker::try_again_or_give_up(const StoredJob& job, PipelineFailure failure) {
  failure.cause = cause_of(failure, store_);
  const std::optional<std::chrono::milliseconds> wait = retry_wait(options_, failure.cause, job.tries);
  if (!wait) return give_up(job, failure);
  log_error(write_failure(store_.bundle(job.scan), job, failure));
  count([&](RunnerTally& tally) { ++tally.retries[std::string(name_of(failure.cause))]; });
  const std::string reason = failure.message();
  spdlog::warn("scan {}: {} ({}); tried again in {} s", job.scan, reason, name_of(failure.cause),
               std::chrono::duration<double>(*wait).count());
  events_.progress(job.scan, failure.stage, 0.0, "is tried again: " + reason);
  log_error(store_.put_back_job(job.scan, reason, events_.now() + *wait));
}

void Runner::Worker::count_stages(const std::vector<StageReport>& reports) {
  count([&](RunnerTally& tally) {
    ++tally.finished;
    for (const StageReport& report : reports) {
      if (report.resumed) continue;
      ++tally.stage_runs[report.name];
      tally.stage_seconds[report.name] += report.seconds;
    }
  });
}

void Runner::Worker::count(const std::function<void(RunnerTally&)>& add) {
  const std::scoped_lock lock(mutex_);
  add(tally_);
}

void Runner::Worker::give_up(const StoredJob& job, const PipelineFailure& failure) {
  spdlog::error("scan {}: {}", job.scan, failure.message());
  count([](RunnerTally& tally) { ++tally.failed; });
  log_error(write_failure(store_.bundle(job.scan), job, failure));
  log_error(events_.failed(job.scan, failure.message()));
}

Result<std::vector<ScanStatus>> Runner::Worker::status() const {
  const Result<std::vector<StoredScan>> scans = store_.scans();
  if (!scans) return tl::unexpected(scans.error());
  const Result<std::vector<StoredJob>> jobs = store_.jobs();
  if (!jobs) return tl::unexpected(jobs.error());
  std::map<std::string, std::string> devices;
  for (const StoredScan& scan : *scans) devices[scan.id] = scan.device_name;
  std::vector<ScanStatus> all;
  const std::scoped_lock lock(mutex_);
  for (const StoredJob& job : *jobs) {
    ScanStatus one{job.scan, job.phase, "", 0.0, job.reason, job.tries, devices[job.scan]};
    const auto found = active_.find(job.scan);
    if (job.phase == StorePhase::running && found != active_.end()) {
      one.stage = found->second->stage;
      one.fraction = found->second->fraction;
      one.text = found->second->text;
    }
    if (job.phase == StorePhase::done) one.fraction = 1.0;
    all.push_back(std::move(one));
  }
  return all;
}

Result<void> Runner::Worker::cancel(const std::string& scan_id) {
  {
    std::unique_lock lock(mutex_);
    const auto found = active_.find(scan_id);
    if (found != active_.end() && !found->second->ended) {
      found->second->cancelled = true;
      changed_.wait(lock, [&] {
        const auto still = active_.find(scan_id);
        return still == active_.end() || still->second->ended;
      });
      return {};
    }
  }
  const Result<std::optional<StoredScan>> scan = store_.scan(scan_id);
  if (!scan) return tl::unexpected(scan.error());
  if (!*scan) return wrong_use("no such scan in the store", scan_id);
  if ((*scan)->phase != StorePhase::queued) {
    return wrong_use("the scan is " + std::string(name_of((*scan)->phase)) + ", there is nothing to cancel", scan_id);
  }
  return events_.failed(scan_id, cancelled_by_user);
}

Result<void> Runner::Worker::rerun(const std::string& scan_id, const json& changes) {
  if (Result<void> known = check_stage_options(stages_, changes); !known) return known;
  const std::string patch = changes.is_null() ? "{}" : changes.dump();
  if (Result<void> queued = store_.retry_job(scan_id, patch); !queued) return queued;
  wake();
  return {};
}

Result<DeletionReceipt> Runner::Worker::delete_scan(const std::string& scan_id) {
  const Result<std::optional<StoredScan>> scan = store_.scan(scan_id);
  if (!scan) return tl::unexpected(scan.error());
  const bool has_job = *scan && ((*scan)->phase == StorePhase::queued || (*scan)->phase == StorePhase::running);
  // A job that ends by itself meanwhile is as good.
  if (has_job) static_cast<void>(cancel(scan_id));
  return store_.delete_scan(scan_id);
}

Runner::Runner(RunnerOptions options, Store& store, Executor& executor, std::vector<Stage> stages, RunnerEvents events)
    : worker_(std::make_unique<Worker>(std::move(options), store, executor, std::move(stages), std::move(events))) {}

Runner::~Runner() = default;

void Runner::start() {
  worker_->start();
}
void Runner::stop() {
  worker_->stop();
}
void Runner::wake() {
  worker_->wake();
}
Result<std::vector<ScanStatus>> Runner::status() const {
  return worker_->status();
}
RunnerTally Runner::tally() const {
  return worker_->tally();
}
Result<void> Runner::cancel(const std::string& scan_id) {
  return worker_->cancel(scan_id);
}
Result<void> Runner::rerun(const std::string& scan_id, const nlohmann::json& changes) {
  return worker_->rerun(scan_id, changes);
}
Result<DeletionReceipt> Runner::delete_scan(const std::string& scan_id) {
  return worker_->delete_scan(scan_id);
}

}  // namespace gyre
