// SPDX-License-Identifier: Apache-2.0
// Tells when a camera's automatic exposure has come to rest, from its pictures alone.
#pragma once

#include <deque>

namespace gyre {

// Settled: for half a second the brightness stayed within two levels of 255.
class SettleWatch {
 public:
  void restart() { recent_.clear(); }
  // time: seconds. brightness: mean level, 0 to 255. True when it is settled.
  bool add(double time, double brightness);

 private:
  struct Reading {
    double time = 0.0;
    double brightness = 0.0;
  };
  std::deque<Reading> recent_;
};

}  // namespace gyre
