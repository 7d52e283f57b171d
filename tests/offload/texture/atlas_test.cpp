// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/atlas.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const std::vector<Eigen::Vector2d> square = {{0.25, 0.25}, {0.75, 0.25}, {0.75, 0.75}, {0.25, 0.75}};

TEST(Atlas, CoversTexelCentresOnceAndInterpolatesExactly) {
  const std::vector<Eigen::Vector3i> triangles = {{0, 1, 2}, {0, 2, 3}};
  const Atlas atlas = map_atlas(square, triangles, 32, 0);
  int covered = 0;
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    ++covered;
    const Eigen::Vector3d w = corner_weights(atlas, i);
    Eigen::Vector2d uv = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k) uv += w[k] * square[triangles[atlas.triangle[i]][k]];
    EXPECT_NEAR(uv.x(), (i % 32 + 0.5) / 32, 1e-6);
    EXPECT_NEAR(uv.y(), (i / 32 + 0.5) / 32, 1e-6);
  }
  EXPECT_EQ(covered, 16 * 16);
}

TEST(Atlas, TakesMirroredTriangles) {
  const std::vector<Eigen::Vector3i> triangles = {{2, 1, 0}, {3, 2, 0}};
  const Atlas atlas = map_atlas(square, triangles, 32, 0);
  EXPECT_EQ(std::count_if(atlas.triangle.begin(), atlas.triangle.end(), [](int t) { return t >= 0; }), 16 * 16);
}

TEST(Atlas, RimContinuesTheBorderTriangle) {
  const std::vector<Eigen::Vector3i> triangles = {{0, 1, 2}, {0, 2, 3}};
  const Atlas atlas = map_atlas(square, triangles, 32, 2);
  EXPECT_EQ(std::count_if(atlas.triangle.begin(), atlas.triangle.end(), [](int t) { return t >= 0; }), 20 * 20);
  const std::size_t beside = 16 * 32 + 7;  // one texel left of the square
  const Eigen::Vector3d w = corner_weights(atlas, beside);
  double u = 0;
  for (int k = 0; k < 3; ++k) u += w[k] * square[triangles[atlas.triangle[beside]][k]].x();
  EXPECT_NEAR(u, 7.5 / 32, 1e-6);
}

}  // namespace
}  // namespace gyre
