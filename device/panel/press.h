// SPDX-License-Identifier: Apache-2.0
// What a press of the one button means, by how long it was. Pure: time comes in.
#pragma once

#include <optional>

namespace gyre {

enum class Press { short_press, long_press, very_long_press };

struct PressOptions {
  double long_s = 0.8;       // seconds from which a press is a long one
  double very_long_s = 4.0;  // and a very long one
};

// Edges without bounces, in order. Every press counts once: when the button is let go, a very long one as soon as it
// is that long, so that the operator knows when to let go.
class PressClassifier {
 public:
  explicit PressClassifier(const PressOptions& options = {}) : options_(options) {}

  // time: seconds. An edge that repeats the one before says nothing.
  std::optional<Press> edge(double time, bool is_down);

  // Time has passed without an edge.
  std::optional<Press> wait(double time);

  bool is_down() const { return down_since_.has_value(); }

 private:
  PressOptions options_;
  std::optional<double> down_since_;
  bool is_counted_ = false;
};

}  // namespace gyre
