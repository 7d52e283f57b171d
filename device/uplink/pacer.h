// SPDX-License-Identifier: Apache-2.0
// How much of the bulk may be under way at a time: no more than the host gives credit for, than the line carries in
// half a second, and than the operator allows.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

namespace gyre {

// Whatever waits in the sockets is in the way of small messages, so a queue there must be short in time, not in bytes:
// what the host took during the last half second may be under way, and never less than four chunks. That fills any line
// of up to half a second there and back, and grows from the start as TCP's slow start does, since every byte taken adds
// one.
class Pacer {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // limit: bytes a second on average, 0 for none.
  explicit Pacer(double limit = 0.0) : limit_(limit) {}

  void grant(std::uint64_t bytes, Time now);
  bool may_send(std::uint64_t cost, Time now);
  void sent(std::uint64_t cost, Time now);

  // How long only the operator's limit stands in the way, from `now`; zero when it does not.
  std::chrono::milliseconds wait(Time now) const;

 private:
  void refill(Time now);

  struct Taken {
    Time when;
    std::uint64_t bytes;
  };
  double limit_;
  double allowance_ = 0.0;  // bytes the limit leaves now; negative: to be waited for
  Time refilled_{};
  std::uint64_t credit_ = 0;
  std::uint64_t under_way_ = 0;
  std::uint64_t taken_bytes_ = 0;  // sum of taken_
  std::deque<Taken> taken_;        // by the host, during the last half second
};

}  // namespace gyre
