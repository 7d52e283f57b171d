// SPDX-License-Identifier: Apache-2.0
#include "device/panel/lamp.h"

#include <string_view>

namespace gyre {

namespace {

constexpr std::string_view pwm_prefix = "pwm:";

}  // namespace

Result<void> check_lamp_name(const std::string& name) {
  if (name.starts_with(pwm_prefix)) {
    const Result<PwmName> pwm = parse_pwm_name(std::string_view(name).substr(pwm_prefix.size()));
    return pwm ? Result<void>() : tl::unexpected(pwm.error());
  }
  const Result<LineName> line = parse_line_name(name);
  return line ? Result<void>() : tl::unexpected(line.error());
}

Result<Lamp> Lamp::open(const std::string& name) {
  if (const Result<void> valid = check_lamp_name(name); !valid) return tl::unexpected(valid.error());
  Lamp lamp;
  if (name.starts_with(pwm_prefix)) {
    Result<std::unique_ptr<Pwm>> pwm = Pwm::open(*parse_pwm_name(std::string_view(name).substr(pwm_prefix.size())));
    if (!pwm) return tl::unexpected(pwm.error());
    lamp.pwm_ = std::move(*pwm);
  } else {
    Result<std::unique_ptr<OutputLine>> line = open_output(*parse_line_name(name));
    if (!line) return tl::unexpected(line.error());
    lamp.line_ = std::move(*line);
  }
  return lamp;
}

Result<void> Lamp::shine(double level) {
  constexpr double flicker_free = 1000.0;  // Hz
  if (pwm_) return pwm_->set(flicker_free, level);
  return line_->set(level >= 0.5);
}

Result<void> Lamp::sound(double frequency) {
  if (pwm_) return pwm_->set(frequency, 0.5);
  return line_->set(frequency > 0.0);
}

}  // namespace gyre
