// SPDX-License-Identifier: Apache-2.0
// A light or a buzzer, on a GPIO line or on a PWM channel.
#pragma once

#include "common/result/result.h"
#include "device/panel/gpio.h"
#include "device/panel/pwm.h"

#include <memory>
#include <string>

namespace gyre {

// "pwm:DEVICE:CHANNEL", or the name of a line as parse_line_name takes it. Belongs to one thread.
class Lamp {
 public:
  // Errors: those of the line or channel; wrong use for a name that is neither.
  static Result<Lamp> open(const std::string& name);

  // 0 to 1; a line is on from a half.
  Result<void> shine(double level);
  // Hz, 0: silence. On a line a buzzer that has one tone of its own.
  Result<void> sound(double frequency);

 private:
  Lamp() = default;
  std::unique_ptr<OutputLine> line_;
  std::unique_ptr<Pwm> pwm_;
};

// Whether a name is one; without looking for it.
Result<void> check_lamp_name(const std::string& name);

}  // namespace gyre
