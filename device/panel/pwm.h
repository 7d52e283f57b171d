// SPDX-License-Identifier: Apache-2.0
// A PWM channel of the kernel's sysfs interface, for lights that fade and buzzers that play tones.
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace gyre {

// "DEVICE:CHANNEL": the device that the chip belongs to, as /sys/class/pwm/pwmchip*/device names it ("fe20c000.pwm");
// the chips' numbers change from boot to boot.
struct PwmName {
  std::string device;
  int channel = 0;
};
Result<PwmName> parse_pwm_name(std::string_view text);

// Belongs to one thread.
class Pwm {
 public:
  // A channel that this brings into being belongs to root until udev has dealt with it; `patience` is for that.
  // Errors: no such device or channel, no permission.
  static Result<std::unique_ptr<Pwm>> open(const PwmName& name, const std::filesystem::path& root = "/sys/class/pwm",
                                           std::chrono::milliseconds patience = std::chrono::seconds(2));
  // Off.
  ~Pwm();
  Pwm(const Pwm&) = delete;
  Pwm& operator=(const Pwm&) = delete;

  // frequency: Hz, 0 switches off; duty: share of the time that it is on, 0 to 1.
  Result<void> set(double frequency, double duty);

 private:
  explicit Pwm(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<void> write(const char* name, long long value) const;

  std::filesystem::path folder_;
  long long period_ = 0, on_ = 0;  // nanoseconds
  bool is_enabled_ = false;
};

}  // namespace gyre
