// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/bundle_checker.h"

#include "common/bundle/bundle.h"

#include <utility>

namespace gyre {

BundleChecker::BundleChecker(const Store& store, std::function<void()> on_checked)
    : store_(store), on_checked_(std::move(on_checked)), thread_([this] { run(); }) {}

BundleChecker::~BundleChecker() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
}

void BundleChecker::add(std::string scan) {
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(std::move(scan));
  changed_.notify_all();
}

void BundleChecker::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty(); });
}

std::vector<CheckedBundle> BundleChecker::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(checked_, {});
}

void BundleChecker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (stopping_) return;
    const std::string scan = waiting_.front();
    lock.unlock();
    Result<void> good = verify_bundle(store_.bundle(scan));
    lock.lock();
    waiting_.pop_front();
    checked_.push_back({scan, std::move(good)});
    changed_.notify_all();
    lock.unlock();
    on_checked_();
    lock.lock();
  }
}

}  // namespace gyre
