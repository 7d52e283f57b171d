// SPDX-License-Identifier: Apache-2.0
// The square of a number, which the costs of places are sums of.
#pragma once

namespace gyre {

inline double squared(double x) {
  return x * x;
}

}  // namespace gyre
