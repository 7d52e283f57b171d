// SPDX-License-Identifier: Apache-2.0
// The middle value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace gyre {

// The upper of the two middle ones of an even number; `values` must not be empty.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace gyre
