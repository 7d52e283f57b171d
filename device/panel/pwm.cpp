// SPDX-License-Identifier: Apache-2.0
#include "device/panel/pwm.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <thread>

namespace gyre {

namespace {

namespace fs = std::filesystem;

Result<void> write_number(const fs::path& file, long long value) {
  std::ofstream out(file);
  out << value << std::flush;
  if (!out) return fail("cannot write to the PWM channel", file.string(), "let this user be in the group gpio");
  return {};
}

// Waits until a channel may be written to.
void wait_for(const fs::path& channel, std::chrono::milliseconds patience) {
  constexpr std::chrono::milliseconds look_every{10};
  const auto end = std::chrono::steady_clock::now() + patience;
  // The last of its files to be handed over may be any of them.
  const auto is_ours = [&] {
    return std::ranges::all_of(std::array{"period", "duty_cycle", "enable"}, [&](const char* const file) {
      const int fd = ::open((channel / file).c_str(), O_WRONLY | O_CLOEXEC);
      if (fd >= 0) ::close(fd);
      return fd >= 0;
    });
  };
  while (!is_ours() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(look_every);
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

Result<std::unique_ptr<Pwm>> Pwm::open(const PwmName& name, const fs::path& root, std::chrono::milliseconds patience) {
  std::error_code error;
  for (auto it = fs::directory_iterator(root, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    std::error_code ignored;
    if (fs::canonical(it->path() / "device", ignored).filename() != name.device) continue;
    const fs::path folder = it->path() / ("pwm" + std::to_string(name.channel));
    if (!fs::exists(folder, ignored)) {
      if (const Result<void> exported = write_number(it->path() / "export", name.channel); !exported) {
        return tl::unexpected(exported.error());
      }
      wait_for(folder, patience);
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
