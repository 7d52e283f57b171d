// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/triangle.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <random>

namespace gyre {
namespace {

// Whatever the point, no point of a fine grid over the triangle is closer than the answer.
TEST(ClosestWeights, NoPointOfTheTriangleIsCloser) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int round = 0; round < 200; ++round) {
    const Eigen::Vector3d a = any(), b = any(), c = any(), p = 2 * any();
    const Eigen::Vector3d w = closest_weights(p, a, b, c);
    EXPECT_NEAR(w.sum(), 1.0, 1e-12);
    EXPECT_GE(w.minCoeff(), 0.0);
    const double distance = (w[0] * a + w[1] * b + w[2] * c - p).norm();
    constexpr int steps = 40;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const Eigen::Vector3d q = (i * a + j * b + (steps - i - j) * c) / steps;
        ASSERT_LE(distance, (q - p).norm() + 1e-12);
      }
    }
  }
}

TEST(ClosestWeights, IsExactOnCornersEdgesAndInside) {
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  EXPECT_EQ(closest_weights({-1, -1, 5}, a, b, c), Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(closest_weights({3, -1, 5}, a, b, c), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(closest_weights({-1, 3, 5}, a, b, c), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(closest_weights({0.25, -2, 1}, a, b, c), Eigen::Vector3d(0.75, 0.25, 0));
  EXPECT_EQ(closest_weights({-2, 0.25, 1}, a, b, c), Eigen::Vector3d(0.75, 0, 0.25));
  EXPECT_EQ(closest_weights({2, 2, 1}, a, b, c), Eigen::Vector3d(0, 0.5, 0.5));
  EXPECT_EQ(closest_weights({0.25, 0.5, -7}, a, b, c), Eigen::Vector3d(0.25, 0.25, 0.5));
}

}  // namespace
}  // namespace gyre
