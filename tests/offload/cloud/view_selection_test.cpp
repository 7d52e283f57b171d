// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/view_selection.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <algorithm>

namespace gyre {
namespace {

std::vector<StereoView> posed(const std::vector<Pose>& poses) {
  std::vector<StereoView> views;
  for (const Pose& pose : poses) views.push_back({"view", test::test_camera(160), pose, {}});
  return views;
}

std::vector<std::vector<int>> neighbours_of(const std::vector<StereoView>& views, const ViewSelectionOptions& options) {
  return select_neighbours(views, std::vector<char>(views.size(), 1), test::RayScene().region(), options);
}

TEST(ViewSelection, RingPicksItsNearestNeighboursOnBothSides) {
  const test::RayScene scene;
  const auto neighbours = neighbours_of(posed(test::arc(scene, 36, 10.0)), {.count = 4});
  for (int i = 0; i < 36; ++i) {
    std::vector<int> expected{(i + 34) % 36, (i + 35) % 36, (i + 1) % 36, (i + 2) % 36};
    std::vector<int> found = neighbours[i];
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected) << "view " << i;
  }
}

TEST(ViewSelection, PrefersViewsOfTheSameScale) {
  const test::RayScene scene;
  std::vector<Pose> poses = test::arc(scene, 3, 10.0);
  // The third view is taken from three times as far.
  poses[2].translation += Eigen::Vector3d(0, 0, 2.4);
  const auto neighbours = neighbours_of(posed(poses), {});
  ASSERT_EQ(neighbours[1].size(), 2U);
  EXPECT_EQ(neighbours[1][0], 0);
  EXPECT_EQ(neighbours[1][1], 2);
}

TEST(ViewSelection, ViewsTooCloseOrTooFarApartAreNoNeighbours) {
  const test::RayScene scene;
  for (const double step : {0.2, 80.0}) {
    for (const auto& list : neighbours_of(posed(test::arc(scene, 3, step)), {})) {
      EXPECT_TRUE(list.empty()) << step;
    }
  }
}

TEST(ViewSelection, UnusedViewsAreNobodysNeighbours) {
  const test::RayScene scene;
  std::vector<char> use(36, 1);
  use[5] = 0;
  const auto neighbours = select_neighbours(posed(test::arc(scene, 36, 10.0)), use, scene.region(), {.count = 4});
  EXPECT_TRUE(neighbours[5].empty());
  for (const std::vector<int>& list : neighbours) EXPECT_EQ(std::count(list.begin(), list.end(), 5), 0);
  EXPECT_EQ(neighbours[4].size(), 4U);
}

}  // namespace
}  // namespace gyre
