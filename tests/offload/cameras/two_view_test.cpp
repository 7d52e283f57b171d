// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/resection.h"
#include "offload/cameras/verification.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// Matches of views 0 and 1 of an orbit, a third of them false.
struct TwoViews {
  Orbit orbit;
  const ViewPair* pair = nullptr;
  TwoViews() {
    OrbitOptions options;
    options.outlier_share = 0.33;
    orbit = make_orbit(options);
    orbit.scene = true_scene(orbit);
    pair =
        &*std::find_if(orbit.pairs.begin(), orbit.pairs.end(), [](const ViewPair& p) { return p.a == 0 && p.b == 1; });
  }
  const View& a() const { return orbit.scene.views[0]; }
  const View& b() const { return orbit.scene.views[1]; }
  bool is_true(const Match& m) const {
    return orbit.point_of[0][static_cast<std::size_t>(m.a)] == orbit.point_of[1][static_cast<std::size_t>(m.b)];
  }
};

TEST(Verification, keeps_true_matches_and_drops_false_ones) {
  const TwoViews two;
  const auto kept = verify_matches(two.a().keypoints, two.b().keypoints, two.pair->matches);
  const auto is_true = [&](const Match& m) { return two.is_true(m); };
  const auto true_before = std::count_if(two.pair->matches.begin(), two.pair->matches.end(), is_true);
  const auto true_after = std::count_if(kept.begin(), kept.end(), is_true);
  EXPECT_GE(true_after, 0.97 * static_cast<double>(true_before));
  EXPECT_LE(static_cast<double>(kept.size()) - static_cast<double>(true_after),
            0.04 * static_cast<double>(kept.size()));
  EXPECT_EQ(kept, verify_matches(two.a().keypoints, two.b().keypoints, two.pair->matches));
}

TEST(Verification, random_matches_verify_nothing) {
  const TwoViews two;
  std::vector<Match> random;
  for (int i = 0; i < 60; ++i) random.push_back({40 + 7 * i, 40 + 7 * ((i * 37 + 11) % 60)});
  EXPECT_TRUE(verify_matches(two.a().keypoints, two.b().keypoints, random).empty());
}

TEST(Verification, relative_pose_is_the_true_one) {
  const TwoViews two;
  const auto found = relative_pose(two.a().normalised, two.b().normalised, two.pair->matches, 2.0 / 1100);
  ASSERT_TRUE(found);
  const Pose truth = two.orbit.cam_from_world[1] * two.orbit.cam_from_world[0].inverse();
  EXPECT_LT(angle_between(found->b_from_a.rotation, truth.rotation), 0.01);
  EXPECT_GT(found->b_from_a.translation.dot(truth.translation.normalized()), 0.999);
  EXPECT_NEAR(found->median_angle, 0.2, 0.15);
}

TEST(Verification, sampson_distance_of_a_true_match_is_zero) {
  const TwoViews two;
  const Pose b_from_a = two.orbit.cam_from_world[1] * two.orbit.cam_from_world[0].inverse();
  const Eigen::Vector3d in_a = two.orbit.cam_from_world[0] * Eigen::Vector3d(0.1, 1.2, 0.05);
  EXPECT_NEAR(sampson_distance(essential_matrix(b_from_a), in_a.hnormalized(), (b_from_a * in_a).hnormalized()), 0,
              1e-12);
}

TEST(Resection, finds_the_pose_among_false_points) {
  const TwoViews two;
  std::vector<Eigen::Vector3d> world;
  for (std::size_t i = 0; i < two.a().keypoints.size(); ++i) {
    const std::size_t point =
        i % 4 == 0 ? (i * 7919) % two.orbit.points.size() : static_cast<std::size_t>(two.orbit.point_of[0][i]);
    world.push_back(two.orbit.points[point]);
  }
  const auto found = resect(two.a().normalised, world, 4.0 / 1100, 20);
  ASSERT_TRUE(found);
  EXPECT_LT((centre_of(found->cam_from_world) - centre_of(two.orbit.cam_from_world[0])).norm(), 0.005);
  EXPECT_LT(angle_between(found->cam_from_world.rotation, two.orbit.cam_from_world[0].rotation), 0.002);
  EXPECT_GE(static_cast<double>(found->inliers.size()), 0.74 * static_cast<double>(world.size()));
}

TEST(Resection, nothing_agrees_with_random_points) {
  const TwoViews two;
  std::vector<Eigen::Vector3d> world;
  for (std::size_t i = 0; i < 100; ++i) world.push_back(two.orbit.points[(i * 7919) % two.orbit.points.size()]);
  EXPECT_FALSE(resect(std::span(two.a().normalised).first(100), world, 4.0 / 1100, 20));
}

}  // namespace
}  // namespace gyre
