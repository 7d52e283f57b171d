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

TEST(Consistency, pairs_of_a_repeated_wall_do_not_close_the_ring) {
  // What views 11 to 13 see of view 10, they also claim to see of view 0, which shows another side of the room.
  const Orbit orbit = make_orbit();
  Scene scene = true_scene(orbit);
  for (View& view : scene.views) view.registered = false;
  Scene repeated = scene;
  const std::size_t own = scene.views[0].keypoints.size();
  auto& view = repeated.views[0];
  view.keypoints.insert(view.keypoints.end(), scene.views[10].keypoints.begin(), scene.views[10].keypoints.end());
  view.normalised.insert(view.normalised.end(), scene.views[10].normalised.begin(), scene.views[10].normalised.end());
  std::vector<ViewPair> pairs = orbit.pairs;
  for (const ViewPair& pair : orbit.pairs)
    if (pair.a == 10) {
      pairs.push_back({0, pair.b, pair.matches});
      for (Match& m : pairs.back().matches) m.a += static_cast<int>(own);
    }
  ASSERT_GT(pairs.size(), orbit.pairs.size());
  const auto kept = pairs_that_close(repeated, pairs, {}, 1);
  ASSERT_EQ(kept.size(), orbit.pairs.size());
  for (std::size_t k = 0; k < kept.size(); ++k) EXPECT_EQ(kept[k].b, orbit.pairs[k].b);
}

}  // namespace
}  // namespace gyre
