// SPDX-License-Identifier: Apache-2.0
#include "offload/report/statistics.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

namespace gyre {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

nlohmann::json summary(std::span<const double> values, double factor) {
  if (values.empty()) return {{"mean", nullptr}, {"median", nullptr}, {"p95", nullptr}, {"max", nullptr}};
  const std::vector<double> copy(values.begin(), values.end());
  const double mean = std::accumulate(copy.begin(), copy.end(), 0.0) / static_cast<double>(copy.size());
  return {{"mean", factor * mean},
          {"median", factor * quantile(copy, 0.5)},
          {"p95", factor * quantile(copy, 0.95)},
          {"max", factor * *std::max_element(copy.begin(), copy.end())}};
}

double share_within(std::span<const double> values, double limit) {
  if (values.empty()) return 0.0;
  const auto within = std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
  return static_cast<double>(within) / static_cast<double>(values.size());
}

}  // namespace gyre
