// SPDX-License-Identifier: Apache-2.0
#include "device/panel/pwm.h"

#include <charconv>
#include <cmath>
#include <fstream>

namespace gyre {

namespace {

namespace fs = std::filesystem;

Result<void> write_number(const fs::path& file, long long value) {
  std::ofstream out(file);
  out << value << std::flush;
  if (!out) return fail("cannot write to the PWM channel", file.string(), "let this user be in the group gpio");
  return {};
}

}  // namespace

Result<PwmName> parse_pwm_name(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  PwmName name;
  bool is_valid = colon != std::string_view::npos && colon > 0;
  if (is_valid) {
    const std::string_view number = text.substr(colon + 1);
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), name.channel);
    is_valid = error == std::errc() && end == number.data() + number.size() && name.channel >= 0;
    name.device = text.substr(0, colon);
  }
  if (!is_valid || name.device.find('/') != std::string::npos) {
    return wrong_use("not a PWM channel", std::string(text), "write it as DEVICE:CHANNEL");
  }
  return name;
}

Result<std::unique_ptr<Pwm>> Pwm::open(const PwmName& name, const fs::path& root) {
  std::error_code error;
  for (auto it = fs::directory_iterator(root, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    std::error_code ignored;
    if (fs::canonical(it->path() / "device", ignored).filename() != name.device) continue;
    const fs::path folder = it->path() / ("pwm" + std::to_string(name.channel));
    if (!fs::exists(folder, ignored)) {
      if (const Result<void> exported = write_number(it->path() / "export", name.channel); !exported) {
        return tl::unexpected(exported.error());
      }
    }
    if (!fs::exists(folder, ignored)) {
      return fail("the PWM device has no such channel", name.device + ":" + std::to_string(name.channel));
    }
    return std::unique_ptr<Pwm>(new Pwm(folder));
  }
  return fail("no such PWM device", name.device, "`ls -l /sys/class/pwm/*/device` shows them");
}

Pwm::~Pwm() {
  (void)set(0.0, 0.0);
}

Result<void> Pwm::write(const char* name, long long value) const {
  return write_number(folder_ / name, value);
}

Result<void> Pwm::set(double frequency, double duty) {
  constexpr double second = 1e9;
  if (!(frequency > 0.0)) {
    if (!is_enabled_) return {};
    is_enabled_ = false;
    return write("enable", 0);
  }
  const long long period = std::llround(second / frequency);
  const long long on = std::llround(static_cast<double>(period) * duty);
  // The kernel refuses a period that is shorter than what is on.
  if (period != period_) {
    if (on_ > 0) {
      if (const Result<void> done = write("duty_cycle", 0); !done) return done;
    }
    on_ = 0;
    if (const Result<void> done = write("period", period); !done) return done;
    period_ = period;
  }
  if (on != on_) {
    if (const Result<void> done = write("duty_cycle", on); !done) return done;
    on_ = on;
  }
  if (is_enabled_) return {};
  is_enabled_ = true;
  return write("enable", 1);
}

}  // namespace gyre
