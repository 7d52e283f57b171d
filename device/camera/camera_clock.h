// SPDX-License-Identifier: Apache-2.0
// The time that cameras and their faults go by: the machine's, or one that only passes when somebody waits.
#pragma once

#include <chrono>
#include <thread>

namespace gyre {

class CameraClock {
 public:
  CameraClock() = default;
  CameraClock(const CameraClock&) = delete;
  CameraClock& operator=(const CameraClock&) = delete;
  virtual ~CameraClock() = default;

  // Seconds since some moment; never goes back.
  virtual double now() const = 0;
  virtual void wait(double seconds) = 0;
};

class MachineClock : public CameraClock {
 public:
  double now() const override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  void wait(double seconds) override {
    if (seconds > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  }
};

// For replays as fast as possible: waiting costs nothing, and a run takes the same time every time.
class ReplayClock : public CameraClock {
 public:
  double now() const override { return now_; }
  void wait(double seconds) override {
    if (seconds > 0.0) now_ += seconds;
  }

 private:
  double now_ = 0.0;
};

}  // namespace gyre
