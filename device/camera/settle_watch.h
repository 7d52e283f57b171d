// SPDX-License-Identifier: Apache-2.0
// Tells when a camera's automatic exposure has come to rest, from its pictures alone.
#pragma once

#include <chrono>
#include <deque>
#include <optional>

namespace gyre {

// Settled: for half a second the brightness stayed within two levels of 255.
class SettleWatch {
 public:
  // From the next reading on, and for how long that is worth waiting for.
  void begin(std::chrono::milliseconds patience);
  // The camera's time begins anew.
  void restart();
  // time: seconds. brightness: mean level, 0 to 255. True when it is settled.
  bool add(double time, double brightness);
  // The patience is over.
  bool is_late() const;

 private:
  struct Reading {
    double time = 0.0;
    double brightness = 0.0;
  };
  std::deque<Reading> recent_;
  std::chrono::duration<double> patience_{0.0};
  std::optional<double> begun_;  // time of the first reading
};

}  // namespace gyre
