// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/voxel_thinning.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(VoxelThinning, AveragesByConfidenceWithinACube) {
  PointCloud cloud;
  cloud.points = {{0.001F, 0.001F, 0.001F}, {0.003F, 0.001F, 0.001F}, {0.5F, 0, 0}};
  cloud.normals = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  for (const int level : {0, 2, 1}) cloud.colours.push_back(Rgb::Constant(static_cast<std::uint8_t>(100 * level)));
  cloud.confidence = {0.25F, 0.75F, 0.5F};
  const PointCloud thin = thin_by_voxels(cloud, 0.01);
  ASSERT_EQ(thin.points.size(), 2U);
  EXPECT_NEAR(thin.points[0].x(), 0.0025F, 1e-7F);
  EXPECT_EQ(thin.colours[0], Rgb::Constant(150));
  EXPECT_FLOAT_EQ(thin.confidence[0], 0.75F);
  EXPECT_FLOAT_EQ(thin.confidence[1], 0.5F);
}

TEST(VoxelThinning, KeepsTheTwoSidesOfAThinThingApart) {
  PointCloud cloud;
  cloud.points = {{0.001F, 0.001F, 0.001F}, {0.001F, 0.001F, 0.002F}};
  cloud.normals = {{0, 0, -1}, {0, 0, 1}};
  cloud.colours.resize(2, Rgb::Zero());
  cloud.confidence = {1, 1};
  EXPECT_EQ(thin_by_voxels(cloud, 0.01).points.size(), 2U);
}

}  // namespace
}  // namespace gyre
