// SPDX-License-Identifier: Apache-2.0
// Cores and memory of this machine, shared among the stages that run on it.
#pragma once

#include "offload/pipeline/order.h"

#include <condition_variable>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>

namespace gyre {

// Shares are handed out strictly in the order in which they were asked for: a large one is not overtaken by small ones
// for ever. One that is more than all there is gets all there is.
class Budget {
 public:
  Budget(int cores, double memory_gib) : cores_(cores), memory_gib_(memory_gib), all_cores_(cores), all_(memory_gib) {}
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  class Share {
   public:
    Share(Share&& other) noexcept;
    Share& operator=(Share&&) = delete;
    ~Share();  // gives it back
    int cores() const { return cores_; }

   private:
    friend class Budget;
    Share(Budget& budget, int cores, double memory_gib) : budget_(&budget), cores_(cores), memory_gib_(memory_gib) {}
    Budget* budget_;
    int cores_;
    double memory_gib_;
  };

  // Waits for its turn; nothing when the order is to end.
  std::optional<Share> take(int cores, double memory_gib, const Ask& ask);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int cores_;
  double memory_gib_;
  const int all_cores_;
  const double all_;
  std::list<std::uint64_t> line_;
  std::uint64_t next_ = 0;
};

}  // namespace gyre
