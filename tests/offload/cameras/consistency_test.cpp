// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/consistency.h"

#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(Consistency, true_poses_agree_and_a_misplaced_one_does_not) {
  const Orbit orbit = make_orbit();
  Scene scene = true_scene(orbit);
  const auto pairs_of_view = pairs_of_views(scene, orbit.pairs);
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    EXPECT_TRUE(agrees_with_pairs(scene, orbit.pairs, pairs_of_view[v], static_cast<int>(v), {}));
  scene.views[4].cam_from_world = scene.views[10].cam_from_world;
  EXPECT_FALSE(agrees_with_pairs(scene, orbit.pairs, pairs_of_view[4], 4, {}));
}

TEST(Consistency, neighbours_outweigh_false_pairs_far_away) {
  // View 4 is put where pairs that repeated texture made want it, against its neighbours.
  const Orbit orbit = make_orbit();
  Scene scene = true_scene(orbit);
  std::vector<ViewPair> pairs;
  for (const ViewPair& pair : orbit.pairs)
    if (pair.a != 4 || pair.b == 5) pairs.push_back(pair);
  scene.views[4].cam_from_world = orbit.cam_from_world[10];
  // Matches of views 9 and 11 to view 10's keypoints are true there; hand them to view 4.
  scene.views[4].keypoints = scene.views[10].keypoints;
  scene.views[4].normalised = scene.views[10].normalised;
  for (const ViewPair& pair : orbit.pairs)
    if (pair.a == 10) pairs.push_back({4, pair.b, pair.matches});
  const auto pairs_of_view = pairs_of_views(scene, pairs);
  EXPECT_FALSE(agrees_with_pairs(scene, pairs, pairs_of_view[4], 4, {}));
}

TEST(Consistency, drops_false_matches_and_false_pairs) {
  const Orbit orbit = make_orbit();
  const Scene scene = true_scene(orbit);
  std::vector<ViewPair> pairs = orbit.pairs;
  ViewPair wrong{0, 12, {}};
  for (int i = 0; i < 100; ++i) wrong.matches.push_back({i, (i * 31 + 7) % 100});
  pairs.push_back(wrong);
  const auto kept = consistent_pairs(scene, pairs, {}, 1);
  ASSERT_EQ(kept.size(), orbit.pairs.size());
  int total = 0, wrong_matches = 0;
  for (const ViewPair& pair : kept) {
    for (const Match& m : pair.matches) {
      ++total;
      if (orbit.point_of[static_cast<std::size_t>(pair.a)][static_cast<std::size_t>(m.a)] !=
          orbit.point_of[static_cast<std::size_t>(pair.b)][static_cast<std::size_t>(m.b)])
        ++wrong_matches;
    }
  }
  EXPECT_LT(wrong_matches, total / 100);
}

}  // namespace
}  // namespace gyre
