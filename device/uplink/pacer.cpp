// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/pacer.h"

#include "common/wire/wire.h"

#include <algorithm>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds queue{500};
constexpr std::uint64_t least_window = 4 * wire::cost_of(wire::max_chunk_bytes);
constexpr double burst_s = 0.1;  // the limit may be overdrawn by what it gives in that time

}  // namespace

void Pacer::grant(std::uint64_t bytes, Time now) {
  credit_ += bytes;
  // The first grant is for nothing that was sent.
  const std::uint64_t taken = std::min(bytes, under_way_);
  under_way_ -= taken;
  taken_bytes_ += taken;
  taken_.push_back({now, taken});
}

bool Pacer::may_send(std::uint64_t cost, Time now) {
  while (!taken_.empty() && taken_.front().when + queue < now) {
    taken_bytes_ -= taken_.front().bytes;
    taken_.pop_front();
  }
  refill(now);
  return cost <= credit_ && under_way_ + cost <= std::max(least_window, taken_bytes_) &&
         (limit_ <= 0.0 || allowance_ >= 0.0);
}

void Pacer::sent(std::uint64_t cost, Time now) {
  refill(now);
  credit_ -= std::min(cost, credit_);
  under_way_ += cost;
  if (limit_ > 0.0) allowance_ -= static_cast<double>(cost);
}

void Pacer::refill(Time now) {
  if (limit_ <= 0.0) return;
  if (refilled_ != Time{}) allowance_ += limit_ * std::chrono::duration<double>(now - refilled_).count();
  allowance_ = std::min(allowance_, limit_ * burst_s);
  refilled_ = now;
}

std::chrono::milliseconds Pacer::wait(Time now) const {
  if (limit_ <= 0.0 || allowance_ >= 0.0) return std::chrono::milliseconds(0);
  const auto due =
      refilled_ + std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(-allowance_ / limit_));
  return std::max(std::chrono::ceil<std::chrono::milliseconds>(due - now), std::chrono::milliseconds(1));
}

}  // namespace gyre
