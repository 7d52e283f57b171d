// SPDX-License-Identifier: Apache-2.0
// Figures that sum up many errors.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

namespace gyre {

// The value below which `share` (0 to 1) of the values lie, by linear interpolation between neighbours in order; 0 for
// none.
double quantile(std::vector<double> values, double share);

// {"mean","median","p95","max"} of the values times `factor` (1000: metres to millimetres); nulls for none.
nlohmann::json summary(std::span<const double> values, double factor = 1.0);

// Share of the values that are at most `limit`.
double share_within(std::span<const double> values, double limit);

}  // namespace gyre
