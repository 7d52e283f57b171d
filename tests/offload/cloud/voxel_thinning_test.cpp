// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/voxel_thinning.h"

#include <gtest/gtest.h>
#include <cmath>

namespace gyre {
namespace {

TEST(VoxelThinning, AveragesByConfidenceWithinACube) {
  PointCloud cloud;
  cloud.points = {{0.001F, 0.001F, 0.001F}, {0.003F, 0.001F, 0.001F}, {0.5F, 0, 0}};
  cloud.normals = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  for (const int level : {0, 2, 1}) cloud.colours.push_back(Rgb::Constant(static_cast<std::uint8_t>(100 * level)));
  cloud.confidence = {0.25F, 0.75F, 0.5F};
  cloud.deviation = {0.004F, 0.002F, 0.003F};
  const PointCloud thin = thin_by_voxels(cloud, 0.01);
  ASSERT_EQ(thin.points.size(), 2U);
  EXPECT_NEAR(thin.points[0].x(), 0.0025F, 1e-7F);
  EXPECT_EQ(thin.colours[0], Rgb::Constant(150));
  EXPECT_FLOAT_EQ(thin.confidence[0], 0.75F);
  EXPECT_FLOAT_EQ(thin.confidence[1], 0.5F);
  EXPECT_FLOAT_EQ(thin.deviation[0], 0.0025F);  // as the confidences weigh: the points lie on one plane
  EXPECT_FLOAT_EQ(thin.deviation[1], 0.003F);
}

TEST(VoxelThinning, MorePointsOfTheSameViewsAreNoBetterAndTheirDisagreementCounts) {
  // Two layers 2 mm apart, each point said to be good to a millimetre: the mean is a millimetre from either.
  PointCloud cloud;
  for (int i = 0; i < 8; ++i) {
    cloud.points.emplace_back(0.001F * static_cast<float>(1 + i / 2), i % 2 == 0 ? 0.004F : 0.006F, 0.002F);
    cloud.normals.emplace_back(0, 1, 0);
  }
  cloud.colours.resize(8, Rgb::Zero());
  cloud.confidence.resize(8, 0.5F);
  cloud.deviation.resize(8, 0.001F);
  const PointCloud thin = thin_by_voxels(cloud, 0.01);
  ASSERT_EQ(thin.points.size(), 1U);
  EXPECT_NEAR(thin.deviation[0], 0.001 * std::sqrt(2.0), 1e-6);
}

TEST(VoxelThinning, KeepsTheTwoSidesOfAThinThingApart) {
  PointCloud cloud;
  cloud.points = {{0.001F, 0.001F, 0.001F}, {0.001F, 0.001F, 0.002F}};
  cloud.normals = {{0, 0, -1}, {0, 0, 1}};
  cloud.colours.resize(2, Rgb::Zero());
  cloud.confidence = {1, 1};
  cloud.deviation = {0, 0};
  EXPECT_EQ(thin_by_voxels(cloud, 0.01).points.size(), 2U);
}

}  // namespace
}  // namespace gyre
