// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/quantile.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(Median, IsTheMiddleOne) {
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
}

TEST(Quantile, EndsAreTheExtremes) {
  const std::vector<double> values{5, -1, 3, 9, 0};
  EXPECT_EQ(quantile(values, 0.0), -1);
  EXPECT_EQ(quantile(values, 0.5), 3);
  EXPECT_EQ(quantile(values, 1.0), 9);
  EXPECT_EQ(quantile({}, 0.5), 0);
}

}  // namespace
}  // namespace gyre
