// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/uplink.h"

#include "common/bundle/disk_space.h"
#include "common/wire/wakeup.h"
#include "device/uplink/conversation.h"
#include "device/uplink/notices.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <zmq.hpp>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

// How much of a scan the host has.
ScanProgress upload_progress(const SpooledScan& scan) {
  std::size_t stored = 0;
  std::size_t total = 0;
  for (const SpooledFile& file : scan.files) {
    if (file.phase == SpooledFilePhase::discarded) continue;
    ++total;
    if (file.phase == SpooledFilePhase::acknowledged) ++stored;
  }
  const double fraction = total > 0 ? static_cast<double>(stored) / static_cast<double>(total) : 0.0;
  return {"upload", fraction, std::to_string(stored) + " of " + std::to_string(total) + " files at the host"};
}

}  // namespace

Result<void> UplinkOptions::check() const {
  if (!host.starts_with("tcp://")) return wrong_use("not the address of a host", host, "write it as tcp://HOST:7410");
  if (!is_public_key(host_public_key)) {
    return wrong_use("the host's key is missing or not a key", host_public_key, "pair this device with the host");
  }
  if (!is_public_key(keys.public_key)) return wrong_use("this device has no key pair", "", "pair it with the host");
  if (!(limit_bytes_per_s >= 0.0)) return wrong_use("limit_bytes_per_s is negative");
  if (reconnect_min.count() <= 0 || reconnect_max < reconnect_min) return wrong_use("reconnect_min and reconnect_max");
  if (refused_retry.count() <= 0) return wrong_use("refused_retry");
  if (ping_interval.count() <= 0 || silence_timeout <= ping_interval)
    return wrong_use("ping_interval, silence_timeout");
  return {};
}

class Uplink::Worker {
 public:
  Worker(UplinkOptions options, Spool& spool)
      : options_(std::move(options)), spool_(spool), notices_([this](wire::DeviceStatus& status) { fill(status); }) {
    spool_.on_change([this] { wakeup_.notify(); });
    thread_ = std::thread(&Worker::run, this);
  }
  ~Worker() {
    spool_.on_change({});
    stop_ = true;
    wakeup_.notify();
    thread_.join();
  }

  LinkStatus status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }
  const UplinkCounts& counts() const { return counts_; }
  void tell(const std::string& state, const std::string& text, const std::string& scan_id) {
    notices_.set(state, text, scan_id);
    wakeup_.notify();
  }
  void tell(wire::CoveragePreview preview) {
    notices_.publish(std::move(preview));
    wakeup_.notify();
  }
  ScanProgress progress(const std::string& scan_id) const;
  Result<void> wait_for_result(const std::string& scan_id, const ResultWait& wait,
                               const std::function<void(const ScanProgress&)>& progress);

 private:
  void run();
  void fill(wire::DeviceStatus& status) const;
  void pause(std::chrono::milliseconds duration);
  void conclude(const Ending& ending);
  std::optional<Result<void>> verdict(const SpooledScan& scan) const;
  std::optional<Error> patience_over(const std::string& scan_id, const ResultWait& wait, Clock::time_point start) const;
  ScanProgress progress_of(const SpooledScan& scan) const;
  Error kept(const std::string& scan_id, const std::string& what) const;

  const UplinkOptions options_;
  Spool& spool_;
  UplinkCounts counts_;
  Notices notices_;
  Wakeup wakeup_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::uint64_t changes_ = 0;
  LinkStatus status_;
  Clock::time_point last_connected_ = Clock::now();
  std::map<std::string, ScanProgress> progress_;
  std::map<std::string, std::string> refused_;  // scans the host does not take, and why
  std::thread thread_;
};

void Uplink::Worker::run() {
  zmq::context_t context;
  std::chrono::milliseconds delay = options_.reconnect_min;
  const auto change = [this](const auto& what) {
    const std::lock_guard lock(mutex_);
    what();
    ++changes_;
    changed_.notify_all();
  };
  while (!stop_) {
    const ConversationEvents events{
        [&] {
          delay = options_.reconnect_min;
          change([&] { status_ = {LinkStatus::Phase::connected, "connected to " + options_.host}; });
        },
        [&] { change([] {}); },
        [&](const std::string& scan, const std::string& reason) {
          change([&] {
            if (reason.empty()) {
              refused_.erase(scan);
            } else {
              refused_[scan] = reason;
            }
          });
        },
        [&](const wire::StageProgress& m) {
          change([&] { progress_[m.scan] = {m.stage, std::clamp(m.fraction, 0.0, 1.0), m.text}; });
        },
    };
    const Ending ending = Conversation(context, options_, spool_, notices_, counts_, events).hold(wakeup_, stop_);
    if (stop_) return;
    ++(ending.kind == Ending::Kind::refused ? counts_.refused : counts_.lost);
    if (ending.kind == Ending::Kind::refused) delay = options_.reconnect_max;
    change([&] { conclude(ending); });
    pause(delay);
    delay = std::min(2 * delay, options_.reconnect_max);
  }
}

void Uplink::Worker::fill(wire::DeviceStatus& status) const {
  const SpoolWaiting waiting = spool_.waiting();
  status.waiting_scans = static_cast<std::uint32_t>(waiting.scans);
  status.waiting_files = static_cast<std::uint32_t>(waiting.files);
  status.free_bytes = free_bytes(spool_.folder()).value_or(0);
}

// What the end of a conversation means for the operator; the same again is not news.
void Uplink::Worker::conclude(const Ending& ending) {
  if (status_.phase == LinkStatus::Phase::connected) last_connected_ = Clock::now();
  LinkStatus next{LinkStatus::Phase::unreachable, ending.text};
  if (ending.kind == Ending::Kind::refused) next.phase = LinkStatus::Phase::refused;
  if (ending.kind == Ending::Kind::again) next.phase = LinkStatus::Phase::connecting;
  if (next.text != status_.text) spdlog::warn("{}; scans are kept, and sent when it works", next.text);
  status_ = std::move(next);
}

void Uplink::Worker::pause(std::chrono::milliseconds duration) {
  const Clock::time_point end = Clock::now() + duration;
  while (!stop_) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return;
    std::array<zmq::pollitem_t, 1> items = {{{nullptr, wakeup_.descriptor(), ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size(), left);
    if (items[0].revents != 0) wakeup_.clear();
  }
}

Error Uplink::Worker::kept(const std::string& scan_id, const std::string& what) const {
  return {what,
          {},
          "the scan is kept in " + spool_.bundle(scan_id).root().string() + " and sent when it works",
          Error::Kind::failed};
}

// The end of waiting for a scan, if it has come to that. The mutex is held.
std::optional<Result<void>> Uplink::Worker::verdict(const SpooledScan& scan) const {
  switch (scan.phase) {
    case SpoolPhase::delivered:
      return Result<void>();
    case SpoolPhase::failed:
      return fail("the host could not reconstruct the scan", scan.reason);
    case SpoolPhase::recording:
      return wrong_use("the scan is still being recorded", scan.id);
    case SpoolPhase::closed:
    case SpoolPhase::acknowledged:
      break;
  }
  const auto no = refused_.find(scan.id);
  if (no != refused_.end()) return tl::unexpected(kept(scan.id, "the host does not take the scan: " + no->second));
  return std::nullopt;
}

std::optional<Error> Uplink::Worker::patience_over(const std::string& scan_id, const ResultWait& wait,
                                                   Clock::time_point start) const {
  if (status_.phase == LinkStatus::Phase::refused) return kept(scan_id, status_.text);
  const Clock::time_point now = Clock::now();
  const bool connected = status_.phase == LinkStatus::Phase::connected;
  if (!connected && now - std::max(start, last_connected_) > wait.unreachable) return kept(scan_id, status_.text);
  if (now - start > wait.total) return kept(scan_id, "the host has not finished the scan in time");
  return std::nullopt;
}

ScanProgress Uplink::Worker::progress_of(const SpooledScan& scan) const {
  if (scan.phase == SpoolPhase::closed) return upload_progress(scan);
  const auto latest = progress_.find(scan.id);
  return latest != progress_.end() ? latest->second : ScanProgress{"queued", 0.0, "waiting for the host"};
}

ScanProgress Uplink::Worker::progress(const std::string& scan_id) const {
  const std::optional<SpooledScan> scan = spool_.scan(scan_id);
  if (!scan) return {};
  const std::lock_guard lock(mutex_);
  if (const auto no = refused_.find(scan_id); no != refused_.end()) return {"refused", 0.0, no->second};
  return progress_of(*scan);
}

Result<void> Uplink::Worker::wait_for_result(const std::string& scan_id, const ResultWait& wait,
                                             const std::function<void(const ScanProgress&)>& progress) {
  constexpr std::chrono::milliseconds look_again{250};  // for the deadlines; changes wake us at once
  const Clock::time_point start = Clock::now();
  std::unique_lock lock(mutex_);
  for (std::uint64_t seen = changes_ - 1;;) {
    const std::optional<SpooledScan> scan = spool_.scan(scan_id);
    if (!scan) return fail("no such scan in the spool", scan_id);
    if (std::optional<Result<void>> end = verdict(*scan)) return *end;
    if (std::optional<Error> error = patience_over(scan_id, wait, start)) return tl::unexpected(std::move(*error));
    const bool news = std::exchange(seen, changes_) != changes_;
    if (news && progress) {
      const ScanProgress now = progress_of(*scan);
      lock.unlock();
      progress(now);
      lock.lock();
    }
    changed_.wait_for(lock, look_again, [&] { return seen != changes_; });
  }
}

Uplink::Uplink(UplinkOptions options, Spool& spool) : worker_(std::make_unique<Worker>(std::move(options), spool)) {}
Uplink::~Uplink() = default;

LinkStatus Uplink::status() const {
  return worker_->status();
}

const UplinkCounts& Uplink::counts() const {
  return worker_->counts();
}

void Uplink::tell(const std::string& state, const std::string& text, const std::string& scan_id) {
  worker_->tell(state, text, scan_id);
}

void Uplink::tell(wire::CoveragePreview preview) {
  worker_->tell(std::move(preview));
}

ScanProgress Uplink::progress(const std::string& scan_id) const {
  return worker_->progress(scan_id);
}

Result<void> Uplink::wait_for_result(const std::string& scan_id, const ResultWait& wait,
                                     const std::function<void(const ScanProgress&)>& progress) {
  return worker_->wait_for_result(scan_id, wait, progress);
}

}  // namespace gyre
