// SPDX-License-Identifier: Apache-2.0
// GPIO lines found by what they are called, never by a number that changes from boot to boot (libgpiod 2).
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace gyre {

// A line as the configuration names it: "NAME", the name of a line on any chip, or "LABEL:OFFSET", a line of the chip
// with that label. An exclamation mark before it: the line is active when it is low.
struct LineName {
  std::string chip;  // label; empty: any
  std::string line;  // name, or offset
  bool is_active_low = false;
};

// Error (wrong use): no name, an offset that is none, a chip's number in place of its label.
Result<LineName> parse_line_name(std::string_view text);

struct LineEdge {
  double time = 0.0;  // seconds of CLOCK_MONOTONIC
  bool is_active = false;
};

// A button. Belongs to one thread.
class InputLine {
 public:
  InputLine() = default;
  InputLine(const InputLine&) = delete;
  InputLine& operator=(const InputLine&) = delete;
  virtual ~InputLine() = default;

  // The next edge, if one comes within that time. Error: the line is gone.
  virtual Result<std::optional<LineEdge>> next(std::chrono::milliseconds timeout) = 0;
};

// A light or a buzzer that can be on or off. Belongs to one thread.
class OutputLine {
 public:
  OutputLine() = default;
  OutputLine(const OutputLine&) = delete;
  OutputLine& operator=(const OutputLine&) = delete;
  virtual ~OutputLine() = default;

  virtual Result<void> set(bool is_active) = 0;
};

// The kernel debounces: an edge counts when the line has been quiet for that long. A line that is active low is pulled
// up, another one down. Errors: no such line or chip, several of that name, a line somebody else uses, no permission.
Result<std::unique_ptr<InputLine>> open_input(const LineName& name, std::chrono::microseconds debounce);

// Off at first, and when it is closed. Errors: as open_input.
Result<std::unique_ptr<OutputLine>> open_output(const LineName& name);

}  // namespace gyre
