// SPDX-License-Identifier: Apache-2.0
#include "offload/store/retention.h"

#include "offload/store/receipts.h"

#include <spdlog/spdlog.h>

namespace gyre {

void Retention::start() {
  if (policy_.keeps_everything() || thread_.joinable()) return;
  thread_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    do {
      lock.unlock();
      apply();
      lock.lock();
    } while (!changed_.wait_for(lock, interval_, [this] { return stopping_.load(); }));
  });
}

void Retention::stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void Retention::apply() {
  const Result<std::vector<std::string>> ids = store_.expired(policy_, now_());
  if (!ids) return spdlog::error("{}", ids.error().message());
  for (const std::string& id : *ids) {
    if (stopping_) return;
    const Result<DeletionReceipt> receipt = store_.delete_scan(id);
    if (!receipt) {
      spdlog::error("scan {}: {}", id, receipt.error().message());
      continue;
    }
    ++deleted_;
    if (const Result<void> kept = keep_receipt(store_.folder(), *receipt, "by the retention policy"); !kept) {
      spdlog::error("{}", kept.error().message());
    }
  }
}

}  // namespace gyre
