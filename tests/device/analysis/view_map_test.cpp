// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/view_map.h"

#include "tests/device/analysis/staged_views.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using test::StagedViews;

double worst_place(const ViewMap& map, const StagedViews& stage) {
  double worst = 0.0;
  for (const auto& [id, place] : map.points()) worst = std::max(worst, (place - stage.places.at(id)).norm());
  return worst;
}

TEST(ViewMap, PlacesPointsWhereTheyAre) {
  const StagedViews stage;
  ViewMap map = stage.map();
  EXPECT_EQ(map.points().size(), stage.places.size());
  EXPECT_LT(worst_place(map, stage), 1e-9);
  map.adjust();
  EXPECT_LT(worst_place(map, stage), 1e-6) << "what fits stays";
}

TEST(ViewMap, ANarrowAngleGivesNoPlace) {
  const StagedViews stage;
  ViewMap map(stage.camera);
  map.add(stage.see(StagedViews::around(0.0)));
  map.add(stage.see(StagedViews::around(0.005)));
  map.place_new_points();
  EXPECT_TRUE(map.points().empty());
}

TEST(ViewMap, AdjustingMendsTheNewestPose) {
  const StagedViews stage;
  ViewMap map = stage.map();
  View view = stage.see(StagedViews::around(0.15));
  const Pose wrong{rotation_about({0.002, -0.004, 0.001}), Eigen::Vector3d(0.01, 0.005, -0.01)};
  view.cam_from_first = wrong * view.cam_from_first;
  map.add(view);
  map.adjust();
  const Pose& mended = map.views().back().cam_from_first;
  EXPECT_LT(angle_between(mended.rotation, StagedViews::around(0.15).rotation), 1e-5);
  EXPECT_LT((centre_of(mended) - centre_of(StagedViews::around(0.15))).norm(), 1e-4);
}

TEST(ViewMap, WhatIsSeenElsewhereLeavesItsPlaceAndGetsANewOneFromWhatFollows) {
  const StagedViews stage;
  constexpr double aside = 0.1;
  ViewMap map = stage.map();
  map.add(stage.see(StagedViews::around(0.15), 0.0, aside));
  const std::vector<PlacedPoint> left = map.leave_wrong_places();
  EXPECT_EQ(left.size(), StagedViews::subject);
  for (const PlacedPoint& point : left) EXPECT_LT((point.place - stage.places.at(point.id)).norm(), 1e-9);
  EXPECT_EQ(map.points().size(), StagedViews::room);

  map.add(stage.see(StagedViews::around(0.25), 0.0, aside));
  map.place_new_points();
  for (const PlacedPoint& point : left) {
    const Eigen::Vector3d now = stage.places.at(point.id) + Eigen::Vector3d(aside, 0, 0);
    ASSERT_TRUE(map.points().contains(point.id));
    EXPECT_LT((map.points().at(point.id) - now).norm(), 1e-9);
  }
}

TEST(ViewMap, WhatIsOutOfSightIsDropped) {
  const StagedViews stage;
  ViewMap map = stage.map();
  View view = stage.see(StagedViews::around(0.15));
  view.seen.erase(7);
  map.add(view);
  EXPECT_TRUE(map.leave_wrong_places().empty());
  EXPECT_FALSE(map.points().contains(7));
  EXPECT_EQ(map.points().size() + 1, stage.places.size());
}

TEST(ViewMap, KeepsAFewViews) {
  const StagedViews stage;
  ViewMap map(stage.camera);
  for (int i = 0; i < 20; ++i) map.add(stage.see(StagedViews::around(0.05 * i), i));
  EXPECT_EQ(map.views().size(), 8U);
  EXPECT_EQ(map.views().back().time, 19.0);
}

}  // namespace
}  // namespace gyre
