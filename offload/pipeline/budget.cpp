// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/budget.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace gyre {

Budget::Share::Share(Share&& other) noexcept
    : budget_(std::exchange(other.budget_, nullptr)), cores_(other.cores_), memory_gib_(other.memory_gib_) {}

Budget::Share::~Share() {
  if (!budget_) return;
  const std::scoped_lock lock(budget_->mutex_);
  budget_->cores_ += cores_;
  budget_->memory_gib_ += memory_gib_;
  budget_->changed_.notify_all();
}

std::optional<Budget::Share> Budget::take(int cores, double memory_gib, const Ask& ask) {
  cores = std::clamp(cores, 1, all_cores_);
  memory_gib = std::min(memory_gib, all_);
  constexpr std::chrono::milliseconds look_for_orders{200};
  constexpr double rounding_gib = 1e-6;
  std::unique_lock lock(mutex_);
  const auto mine = line_.insert(line_.end(), next_++);
  while (true) {
    lock.unlock();
    const bool go_on = ask() == Order::go_on;
    lock.lock();
    const bool fits = cores_ >= cores && memory_gib_ + rounding_gib >= memory_gib;
    if (!go_on || (line_.begin() == mine && fits)) {
      line_.erase(mine);
      changed_.notify_all();
      if (!go_on) return std::nullopt;
      cores_ -= cores;
      memory_gib_ -= memory_gib;
      return Share(*this, cores, memory_gib);
    }
    changed_.wait_for(lock, look_for_orders);
  }
}

}  // namespace gyre
