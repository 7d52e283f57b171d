// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_filters.h"

#include <gtest/gtest.h>
#include <algorithm>

namespace gyre {
namespace {

void add(PointCloud& cloud, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  cloud.points.push_back(point);
  cloud.normals.push_back(normal);
  cloud.colours.emplace_back(1, 2, 3);
  cloud.confidence.push_back(0.5F);
  cloud.deviation.push_back(0.001F);
}

// A cube of n^3 points with 1 cm between them.
void add_block(PointCloud& cloud, const Eigen::Vector3f& corner, int n) {
  for (int i = 0; i < n * n * n; ++i) {
    add(cloud,
        corner + 0.01F * Eigen::Vector3f(static_cast<float>(i % n), static_cast<float>(i / n % n),
                                         static_cast<float>(i / n / n)),
        Eigen::Vector3f::UnitX());
  }
}

TEST(CloudFilters, FloorIsLowAndFacesUp) {
  PointCloud cloud;
  add(cloud, {0, 0.008F, 0}, {0, 1, 0});  // floor
  add(cloud, {0, 0.008F, 0}, {1, 0, 0});  // side of a sole
  add(cloud, {0, 0.001F, 0}, {1, 0, 0});  // at the floor itself
  add(cloud, {0, 0.05F, 0}, {0, 1, 0});   // top of a foot
  EXPECT_EQ(above_floor(cloud, {}), (std::vector<char>{0, 1, 0, 1}));
}

TEST(CloudFilters, SpecksAreFound) {
  PointCloud cloud;
  add_block(cloud, {0, 0, 0}, 4);
  add(cloud, {0.5F, 0, 0}, {1, 0, 0});
  std::vector<char> keep = well_surrounded(cloud, 0.02, 4);
  EXPECT_EQ(keep.back(), 0);
  keep.pop_back();
  EXPECT_TRUE(std::all_of(keep.begin(), keep.end(), [](char k) { return k == 1; }));
}

TEST(CloudFilters, SubjectClustersWinAndLooseHandsStay) {
  const SubjectRegion region{Eigen::Vector3d(-1, 0, -1), Eigen::Vector3d(1, 2, 1)};
  PointCloud cloud;
  add_block(cloud, {0, 1, 0}, 10);         // 1000 points on the axis
  add_block(cloud, {0.3F, 1, 0}, 5);       // 125 near it
  add_block(cloud, {0.6F, 1, 0}, 2);       // 8: a speck
  add_block(cloud, {-0.95F, 1, 0.9F}, 4);  // 64 in a far corner count little
  const PointCloud kept = selected(cloud, subject_clusters(cloud, region, {}));
  EXPECT_EQ(kept.points.size(), 1125U);
  EXPECT_EQ(kept.normals.size(), 1125U);
  EXPECT_EQ(kept.colours.size(), 1125U);
  EXPECT_EQ(kept.confidence.size(), 1125U);
}

TEST(CloudFilters, EmptyCloudIsFine) {
  const PointCloud cloud;
  EXPECT_TRUE(subject_clusters(cloud, {}, {}).empty());
  EXPECT_TRUE(well_surrounded(cloud, 0.01, 3).empty());
}

}  // namespace
}  // namespace gyre
