// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/fill.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A strip of four squares along u, five texels wide each, of which the outer two have a colour.
class Strip : public testing::Test {
 protected:
  static constexpr int size_ = 20;

  Strip() {
    std::vector<Eigen::Vector2d> uv;
    for (int i = 0; i <= 4; ++i) {
      uv.emplace_back(i / 4.0, 0.0);
      uv.emplace_back(i / 4.0, 0.25);
    }
    for (int i = 0; i < 4; ++i) {
      triangles_.emplace_back(2 * i, 2 * i + 2, 2 * i + 3);
      triangles_.emplace_back(2 * i, 2 * i + 3, 2 * i + 1);
    }
    atlas_ = map_atlas(uv, triangles_, size_, 0);
    canvas_.colour.assign(atlas_.texels(), Eigen::Vector3f::Zero());
    canvas_.origin.assign(atlas_.texels(), TexelOrigin::none);
    for (std::size_t i = 0; i < atlas_.texels(); ++i) {
      const int square = atlas_.triangle[i] / 2;
      if (atlas_.triangle[i] < 0 || (square != 0 && square != 3)) continue;
      canvas_.origin[i] = TexelOrigin::strict;
      canvas_.colour[i] = square == 0 ? Eigen::Vector3f(10, 100, 40) : Eigen::Vector3f(210, 100, 40);
    }
  }

  std::vector<Eigen::Vector3i> triangles_;
  Atlas atlas_;
  Canvas canvas_;
};

TEST_F(Strip, IsFilledHarmonically) {
  fill_surface(atlas_, triangles_, 10, std::vector<std::uint8_t>(triangles_.size(), 0), canvas_);
  float last = 0;
  for (int x = 0; x < size_; ++x) {
    const std::size_t i = 2 * size_ + x;
    EXPECT_NE(canvas_.origin[i], TexelOrigin::none);
    EXPECT_GE(canvas_.colour[i][0], last - 1e-3F);
    EXPECT_NEAR(canvas_.colour[i][1], 100.0F, 1e-3F);
    last = canvas_.colour[i][0];
  }
  EXPECT_NEAR(canvas_.colour[2 * size_ + 9][0] + canvas_.colour[2 * size_ + 10][0], 220.0F, 10.0F);
}

TEST_F(Strip, BackgroundTakesTheNearestColours) {
  fill_surface(atlas_, triangles_, 10, std::vector<std::uint8_t>(triangles_.size(), 0), canvas_);
  fill_background(size_, canvas_);
  for (const Eigen::Vector3f& c : canvas_.colour) EXPECT_NEAR(c[1], 100.0F, 1e-2F);
}

}  // namespace
}  // namespace gyre
