// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/subject_region.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const SubjectRegion unit{Eigen::Vector3d(-1, 0, -1), Eigen::Vector3d(1, 2, 1)};

TEST(SubjectRegion, RayThroughTheBoxGivesEntryAndExit) {
  const auto hit = intersect(unit, {0, 1, 5}, {0, 0, -2});
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->near, 2.0);
  EXPECT_DOUBLE_EQ(hit->far, 3.0);
}

TEST(SubjectRegion, RayFromInsideStartsAtZero) {
  const auto hit = intersect(unit, {0, 1, 0}, {1, 0, 0});
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->near, 0.0);
  EXPECT_DOUBLE_EQ(hit->far, 1.0);
}

TEST(SubjectRegion, RayBesideOrAwayFromTheBoxMisses) {
  EXPECT_FALSE(intersect(unit, {3, 1, 5}, {0, 0, -1}));
  EXPECT_FALSE(intersect(unit, {0, 1, 5}, {0, 0, 1}));
}

TEST(SubjectRegion, FloorIsLowAndFacesUp) {
  EXPECT_TRUE(is_floor(0.008, 1.0, {}));
  EXPECT_FALSE(is_floor(0.008, 0.0, {}));  // side of a sole
  EXPECT_TRUE(is_floor(0.001, 0.0, {}));   // at the floor itself
  EXPECT_FALSE(is_floor(0.05, 1.0, {}));   // top of a foot
}

}  // namespace
}  // namespace gyre
