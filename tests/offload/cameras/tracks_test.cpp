// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/tracks.h"

#include "offload/cameras/triangulation.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

Scene empty_scene(std::initializer_list<std::size_t> keypoints) {
  Scene scene;
  for (const std::size_t count : keypoints) {
    scene.views.emplace_back();
    scene.views.back().keypoints.resize(count);
  }
  return scene;
}

TEST(Tracks, matches_are_closed_transitively) {
  Scene scene = empty_scene({2, 2, 2});
  build_tracks(scene, std::vector<ViewPair>{{0, 1, {{0, 1}}}, {1, 2, {{1, 0}}}});
  ASSERT_EQ(scene.tracks.size(), 1U);
  EXPECT_EQ(scene.tracks[0].observations.size(), 3U);
  EXPECT_EQ(scene.views[0].track_of, (std::vector<int>{0, -1}));
  EXPECT_EQ(scene.views[1].track_of, (std::vector<int>{-1, 0}));
  EXPECT_EQ(scene.views[2].track_of, (std::vector<int>{0, -1}));
}

TEST(Tracks, a_match_that_would_join_two_keypoints_of_a_view_is_left_out) {
  Scene scene = empty_scene({2, 3, 2});
  // The weak pair (0, 2) says that keypoint 0 of view 2 is keypoint 1 of view 0; the strong ones say it is 0.
  build_tracks(scene, std::vector<ViewPair>{{0, 2, {{1, 0}}}, {0, 1, {{0, 0}, {1, 1}}}, {1, 2, {{0, 0}, {1, 1}}}});
  ASSERT_EQ(scene.tracks.size(), 2U);
  for (const Track& track : scene.tracks) {
    ASSERT_EQ(track.observations.size(), 3U);
    for (const Observation& o : track.observations) EXPECT_EQ(o.keypoint, track.observations[0].keypoint);
  }
}

TEST(Triangulation, finds_true_points_of_exact_keypoints) {
  OrbitOptions exact;
  exact.pixel_noise = 0;
  exact.outlier_share = 0;
  const Orbit orbit = make_orbit(exact);
  Scene scene = true_scene(orbit);
  for (Track& track : scene.tracks) {
    const Eigen::Vector3d truth = track.point;
    if (triangulate(scene, track, {})) {
      EXPECT_LT((track.point - truth).norm(), 1e-6);
      EXPECT_EQ(track.used_count(), static_cast<int>(track.observations.size()));
    }
  }
}

TEST(Triangulation, leaves_out_a_false_observation) {
  OrbitOptions exact;
  exact.pixel_noise = 0;
  exact.outlier_share = 0;
  const Orbit orbit = make_orbit(exact);
  Scene scene = true_scene(orbit);
  const auto longest = std::max_element(scene.tracks.begin(), scene.tracks.end(), [](const Track& x, const Track& y) {
    return x.observations.size() < y.observations.size();
  });
  const Eigen::Vector3d truth = longest->point;
  Observation& wrong = longest->observations[1];
  auto& view = scene.views[static_cast<std::size_t>(wrong.view)];
  view.keypoints[static_cast<std::size_t>(wrong.keypoint)] += Eigen::Vector2d(40, -25);
  update_normalised(scene, 1);
  ASSERT_TRUE(triangulate(scene, *longest, {}));
  EXPECT_LT((longest->point - truth).norm(), 1e-6);
  EXPECT_FALSE(longest->observations[1].used);
  EXPECT_EQ(longest->used_count(), static_cast<int>(longest->observations.size()) - 1);
}

TEST(Triangulation, parallel_rays_have_no_point) {
  const std::array<Ray, 2> rays{Ray{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()},
                                Ray{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ()}};
  EXPECT_FALSE(intersect_rays(rays));
}

}  // namespace
}  // namespace gyre
