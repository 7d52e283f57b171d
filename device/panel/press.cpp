// SPDX-License-Identifier: Apache-2.0
#include "device/panel/press.h"

namespace gyre {

std::optional<Press> PressClassifier::edge(double time, bool is_down) {
  if (is_down == down_since_.has_value()) return std::nullopt;
  if (is_down) {
    down_since_ = time;
    is_counted_ = false;
    return std::nullopt;
  }
  const double held = time - *down_since_;
  down_since_.reset();
  if (is_counted_) return std::nullopt;
  if (held >= options_.very_long_s) return Press::very_long_press;
  return held >= options_.long_s ? Press::long_press : Press::short_press;
}

std::optional<Press> PressClassifier::wait(double time) {
  if (!down_since_ || is_counted_ || time - *down_since_ < options_.very_long_s) return std::nullopt;
  is_counted_ = true;
  return Press::very_long_press;
}

}  // namespace gyre
