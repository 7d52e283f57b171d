// SPDX-License-Identifier: Apache-2.0
// Quantiles of measurements.
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

// The value that `share` (0 ... 1) of the others lie below; 0 of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace gyre
