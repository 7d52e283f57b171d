// SPDX-License-Identifier: Apache-2.0
#include "device/panel/gpio.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <gpiod.hpp>
#include <system_error>
#include <utility>
#include <vector>

namespace gyre {

namespace {

namespace fs = std::filesystem;

constexpr const char* consumer = "gyre-device";

bool is_number(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char letter) { return std::isdigit(letter) != 0; });
}

std::string text_of(const LineName& name) {
  return name.chip.empty() ? name.line : name.chip + ":" + name.line;
}

// What libgpiod throws, as an error. It must be called in a catch block.
Error error_of(const LineName& name) {
  const std::string what = "cannot use the GPIO line";
  try {
    throw;
  } catch (const std::system_error& e) {
    if (e.code().value() == EBUSY) {
      return {"the GPIO line is busy", text_of(name), "stop what uses it; `gpioinfo` names that"};
    }
    if (e.code().value() == EACCES || e.code().value() == EPERM) {
      return {"no permission for the GPIO line", text_of(name), "let this user be in the group gpio"};
    }
    return {what, text_of(name) + " (" + e.what() + ")", {}};
  } catch (const std::exception& e) {
    return {what, text_of(name) + " (" + e.what() + ")", {}};
  }
}

struct Place {
  fs::path chip;
  unsigned offset = 0;
};

// Chips in the order of their paths; those that cannot be opened are counted, for the error.
struct Chips {
  std::vector<gpiod::chip> open;
  int refused = 0;
};
Chips all_chips() {
  Chips chips;
  std::vector<fs::path> paths;
  std::error_code error;
  for (auto it = fs::directory_iterator("/dev", error); !error && it != fs::directory_iterator(); it.increment(error)) {
    if (it->path().filename().string().starts_with("gpiochip")) paths.push_back(it->path());
  }
  std::sort(paths.begin(), paths.end());
  for (const fs::path& path : paths) {
    try {
      if (!fs::is_symlink(path) && gpiod::is_gpiochip_device(path)) chips.open.emplace_back(path);
    } catch (const std::exception&) {
      ++chips.refused;
    }
  }
  return chips;
}

Result<Place> find(const LineName& name) {
  Chips chips = all_chips();
  std::vector<Place> found;
  bool is_chip_there = name.chip.empty();
  for (gpiod::chip& chip : chips.open) {
    const gpiod::chip_info info = chip.get_info();
    if (!name.chip.empty() && info.label() != name.chip) continue;
    is_chip_there = true;
    if (name.chip.empty()) {
      const int offset = chip.get_line_offset_from_name(name.line);
      if (offset >= 0) found.push_back({chip.path(), static_cast<unsigned>(offset)});
      continue;
    }
    unsigned offset = 0;
    std::from_chars(name.line.data(), name.line.data() + name.line.size(), offset);
    if (offset < info.num_lines()) found.push_back({chip.path(), offset});
  }
  if (found.size() == 1) return found.front();
  if (found.size() > 1) {
    return fail("several GPIO lines are called that", text_of(name), "name it as LABEL:OFFSET; `gpioinfo` lists all");
  }
  if (chips.open.empty()) {
    return chips.refused > 0 ? fail("no permission for GPIO chips", text_of(name), "let this user be in the group gpio")
                             : fail("there is no GPIO chip", text_of(name), "is its driver loaded?");
  }
  if (!is_chip_there) return fail("no GPIO chip has that label", name.chip, "`gpiodetect` lists the labels");
  return fail("no such GPIO line", text_of(name), "`gpioinfo` lists the lines");
}

class GpiodInput : public InputLine {
 public:
  GpiodInput(LineName name, gpiod::line_request request) : name_(std::move(name)), request_(std::move(request)) {}

  Result<std::optional<LineEdge>> next(std::chrono::milliseconds timeout) override {
    try {
      if (at_ == events_.num_events()) {
        if (!request_.wait_edge_events(timeout)) return std::nullopt;
        request_.read_edge_events(events_);
        at_ = 0;
      }
      const gpiod::edge_event& event = events_.get_event(static_cast<unsigned>(at_++));
      constexpr double nanoseconds = 1e-9;
      return LineEdge{static_cast<double>(event.timestamp_ns().ns()) * nanoseconds,
                      event.type() == gpiod::edge_event::event_type::RISING_EDGE};
    } catch (const std::exception&) {
      return tl::unexpected(error_of(name_));
    }
  }

 private:
  static constexpr std::size_t at_once = 64;
  LineName name_;
  gpiod::line_request request_;
  gpiod::edge_event_buffer events_{at_once};
  std::size_t at_ = 0;
};

class GpiodOutput : public OutputLine {
 public:
  GpiodOutput(LineName name, gpiod::line_request request, unsigned offset)
      : name_(std::move(name)), request_(std::move(request)), offset_(offset) {}
  ~GpiodOutput() override { (void)set(false); }

  Result<void> set(bool is_active) final {
    if (is_active == is_active_) return {};
    try {
      request_.set_value(offset_, is_active ? gpiod::line::value::ACTIVE : gpiod::line::value::INACTIVE);
    } catch (const std::exception&) {
      return tl::unexpected(error_of(name_));
    }
    is_active_ = is_active;
    return {};
  }

 private:
  LineName name_;
  gpiod::line_request request_;
  gpiod::line::offset offset_;
  bool is_active_ = false;
};

gpiod::line_request request(const Place& place, const gpiod::line_settings& settings) {
  constexpr std::size_t events = 512;  // that may wait in the kernel
  return gpiod::chip(place.chip)
      .prepare_request()
      .set_consumer(consumer)
      .set_event_buffer_size(events)
      .add_line_settings(place.offset, settings)
      .do_request();
}

}  // namespace

Result<LineName> parse_line_name(std::string_view text) {
  LineName name;
  name.is_active_low = text.starts_with('!');
  if (name.is_active_low) text.remove_prefix(1);
  const std::string how = "write the line's name, or LABEL:OFFSET; `gpioinfo` lists them";
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    name.line = text;
    if (text.empty() || is_number(text)) return wrong_use("not the name of a GPIO line", std::string(text), how);
    return name;
  }
  name.chip = text.substr(0, colon);
  name.line = text.substr(colon + 1);
  constexpr std::size_t longest = 6;
  if (name.chip.empty() || !is_number(name.line) || name.line.size() > longest) {
    return wrong_use("not a GPIO line", std::string(text), how);
  }
  constexpr std::string_view numbered = "gpiochip";
  if (is_number(name.chip) || (name.chip.starts_with(numbered) && is_number(name.chip.substr(numbered.size())))) {
    return wrong_use("a GPIO chip's number changes from boot to boot", name.chip,
                     "name it by its label; `gpiodetect` lists the labels");
  }
  return name;
}

Result<std::unique_ptr<InputLine>> open_input(const LineName& name, std::chrono::microseconds debounce) {
  try {
    const Result<Place> place = find(name);
    if (!place) return tl::unexpected(place.error());
    gpiod::line_settings settings;
    settings.set_direction(gpiod::line::direction::INPUT)
        .set_edge_detection(gpiod::line::edge::BOTH)
        .set_bias(name.is_active_low ? gpiod::line::bias::PULL_UP : gpiod::line::bias::PULL_DOWN)
        .set_active_low(name.is_active_low)
        .set_event_clock(gpiod::line::clock::MONOTONIC)
        .set_debounce_period(debounce);
    return std::make_unique<GpiodInput>(name, request(*place, settings));
  } catch (const std::exception&) {
    return tl::unexpected(error_of(name));
  }
}

Result<std::unique_ptr<OutputLine>> open_output(const LineName& name) {
  try {
    const Result<Place> place = find(name);
    if (!place) return tl::unexpected(place.error());
    gpiod::line_settings settings;
    settings.set_direction(gpiod::line::direction::OUTPUT)
        .set_active_low(name.is_active_low)
        .set_output_value(gpiod::line::value::INACTIVE);
    return std::make_unique<GpiodOutput>(name, request(*place, settings), place->offset);
  } catch (const std::exception&) {
    return tl::unexpected(error_of(name));
  }
}

}  // namespace gyre
