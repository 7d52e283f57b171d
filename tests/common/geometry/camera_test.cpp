// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/camera.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

Camera lens() {
  return {.width = 720,
          .height = 1280,
          .fx = 1152.3,
          .fy = 1150.8,
          .cx = 358.7,
          .cy = 643.2,
          .k1 = -0.05,
          .k2 = 0.01,
          .p1 = 0.002,
          .p2 = -0.001,
          .k3 = 0.003};
}

TEST(Camera, UndistortionInvertsDistortionEverywhere) {
  const Camera c = lens();
  for (double x = 0; x <= c.width; x += 40) {
    for (double y = 0; y <= c.height; y += 40) {
      const Eigen::Vector2d pixel(x, y);
      EXPECT_LT((c.pixel_from_normalised(c.normalised_from_pixel(pixel)) - pixel).norm(), 1e-9);
    }
  }
}

TEST(Camera, PointsBehindHaveNoPixel) {
  EXPECT_FALSE(lens().project({0, 0, -1}).has_value());
  EXPECT_FALSE(lens().project({0, 0, 0}).has_value());
}

TEST(Camera, AxisProjectsToPrincipalPoint) {
  EXPECT_TRUE(lens().project({0, 0, 3})->isApprox(Eigen::Vector2d(358.7, 643.2)));
}

TEST(Camera, FieldOfViewGivesFocalLength) {
  const Camera c = Camera::from_fov(640, 480, M_PI / 2);
  EXPECT_NEAR(c.fx, 320, 1e-9);
  EXPECT_TRUE(c.project({1, 0, 1})->isApprox(Eigen::Vector2d(640, 240)));
}

TEST(Camera, ScalingKeepsRelativePosition) {
  const Camera c = lens();
  const Camera half = c.scaled(0.5);
  const Eigen::Vector3d p(0.2, -0.4, 1.0);
  EXPECT_TRUE((*c.project(p) * 0.5).isApprox(*half.project(p), 1e-12));
}

class OrientationTest : public testing::TestWithParam<int> {};

// Showing the world through an oriented camera is the same as orienting the picture of the stored camera.
TEST_P(OrientationTest, CameraFollowsThePicture) {
  const auto orientation = static_cast<Orientation>(GetParam());
  const Camera stored = lens();
  const Camera upright = oriented(stored, orientation);
  const Eigen::Vector2d ex = oriented({1, 0}, 0, 0, orientation);
  const Eigen::Vector2d ey = oriented({0, 1}, 0, 0, orientation);
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.1, 0.2, 1), Eigen::Vector3d(-0.25, 0.4, 1.2), Eigen::Vector3d(0.2, -0.3, 0.9)}) {
    const Eigen::Vector2d turned = ex * p.x() + ey * p.y();
    const Eigen::Vector2d expected = oriented(*stored.project(p), stored.width, stored.height, orientation);
    EXPECT_LT((*upright.project({turned.x(), turned.y(), p.z()}) - expected).norm(), 1e-9);
  }
  EXPECT_EQ(upright.width, GetParam() >= 5 ? stored.height : stored.width);
}

INSTANTIATE_TEST_SUITE_P(AllEight, OrientationTest, testing::Range(1, 9));

}  // namespace
}  // namespace gyre
