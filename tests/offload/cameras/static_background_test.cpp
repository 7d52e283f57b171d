// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/static_background.h"

#include "offload/cameras/correspondence.h"
#include "offload/cameras/reconstruction.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const Progress silent = [](double, std::string_view) {};

bool all_are(const StaticBackground& background, Motion motion) {
  return std::all_of(background.motion.begin(), background.motion.end(), [&](Motion m) { return m == motion; });
}

long count_still(const StaticBackground& background) {
  long count = 0;
  for (const auto& still : background.still) count += std::count(still.begin(), still.end(), 1);
  return count;
}

StaticBackground background_of(const std::vector<Features>& features, int threads = 2) {
  return find_static_background(features, std::vector<int>(features.size(), 0), {}, threads);
}

Orbit make_turn(int room_points, int floor_points) {
  OrbitOptions options;
  options.motion = Motion::turn;
  options.room_points = room_points;
  options.floor_points = floor_points;
  return make_orbit(options);
}

TEST(StaticBackground, an_orbit_has_none) {
  const StaticBackground background = background_of(features_of(make_orbit()));
  EXPECT_TRUE(all_are(background, Motion::orbit));
  EXPECT_EQ(count_still(background), 0);
}

TEST(StaticBackground, of_a_turn_is_the_room_and_not_the_subject) {
  const Orbit turn = make_turn(700, 500);
  const StaticBackground background = background_of(features_of(turn));
  EXPECT_TRUE(all_are(background, Motion::turn));
  for (std::size_t v = 0; v < turn.point_of.size(); ++v) {
    EXPECT_LT(background.shift[v].norm(), 0.3);
    int room = 0, room_found = 0, body = 0, body_lost = 0;
    for (std::size_t k = 0; k < turn.point_of[v].size(); ++k) {
      const bool of_body = turn.point_of[v][k] < 500;
      ++(of_body ? body : room);
      if (background.still[v][k] != 0) ++(of_body ? body_lost : room_found);
    }
    EXPECT_EQ(room_found, room);
    EXPECT_LT(body_lost, 0.15 * body) << "of view " << v;  // those beside a point of the room
  }
}

TEST(StaticBackground, a_turn_before_a_plain_background_has_none_but_the_crown) {
  const Orbit turn = make_turn(0, 0);
  const StaticBackground background = background_of(features_of(turn));
  EXPECT_TRUE(all_are(background, Motion::orbit));
  for (std::size_t v = 0; v < turn.point_of.size(); ++v) {
    for (std::size_t k = 0; k < turn.point_of[v].size(); ++k) {
      if (background.still[v][k] == 0) continue;
      EXPECT_GT(turn.points[static_cast<std::size_t>(turn.point_of[v][k])].y(), 1.65);
    }
  }
}

TEST(StaticBackground, bears_a_tripod_that_is_touched) {
  const Orbit turn = make_turn(700, 500);
  std::vector<Features> features = features_of(turn);
  const Eigen::Vector2d push(9, -5);
  for (std::size_t v = 14; v < features.size(); ++v)
    for (Eigen::Vector2d& keypoint : features[v].keypoints) keypoint += push;
  const StaticBackground background = background_of(features);
  EXPECT_TRUE(all_are(background, Motion::turn));
  EXPECT_LT((background.shift[20] - background.shift[3] - push).norm(), 0.3);
  EXPECT_GE(count_still(background), count_still(background_of(features_of(turn))) * 99 / 100);
}

TEST(StaticBackground, a_date_burned_into_the_pictures_makes_no_turn) {
  const Orbit orbit = make_orbit();
  std::vector<Features> features = features_of(orbit);
  for (Features& f : features) {
    for (int i = 0; i < 40; ++i) {
      f.keypoint_of.push_back(static_cast<int>(f.keypoints.size()));
      f.keypoints.emplace_back(600 + 2 * i, 1250 + (i % 3) * 8);
      f.sizes.push_back(1.0F);
      f.colours.push_back({255, 255, 255});
      f.descriptors.push_back(features.front().descriptors[static_cast<std::size_t>(i)]);
    }
  }
  EXPECT_TRUE(all_are(background_of(features), Motion::orbit));
}

TEST(StaticBackground, each_pass_is_judged_by_itself_and_threads_change_nothing) {
  const Orbit turn = make_turn(700, 500), orbit = make_orbit();
  std::vector<Features> features = features_of(turn);
  const std::vector<Features> others = features_of(orbit);
  features.insert(features.end(), others.begin(), others.end());
  std::vector<int> pass_of(features.size(), 0);
  std::fill(pass_of.begin() + 24, pass_of.end(), 1);
  const StaticBackground one = find_static_background(features, pass_of, {}, 1);
  const StaticBackground three = find_static_background(features, pass_of, {}, 3);
  EXPECT_EQ(one.motion.front(), Motion::turn);
  EXPECT_EQ(one.motion.back(), Motion::orbit);
  EXPECT_EQ(one.motion, three.motion);
  EXPECT_EQ(one.still, three.still);
  EXPECT_EQ(one.shift, three.shift);
}

TEST(StaticBackground, outlines_go_with_what_lies_beside_them) {
  // One still keypoint in all pictures, and beside it, in one of them, one that comes and goes.
  std::vector<Features> features(8);
  Descriptor room{}, outline{};
  room[3] = outline[90] = descriptor_norm;
  for (Features& f : features) {
    f.width = f.height = 400;
    f.keypoints = {{200, 200}};
    f.sizes = {2.0F};
    f.colours = {{}};
    f.keypoint_of = {0};
    f.descriptors = {room};
  }
  for (const double x : {207.0, 209.0}) {
    features[4].keypoint_of.push_back(static_cast<int>(features[4].keypoints.size()));
    features[4].keypoints.emplace_back(x, 200);
    features[4].sizes.push_back(2.0F);
    features[4].colours.push_back({});
    features[4].descriptors.push_back(outline);
  }
  const StaticBackground background = background_of(features);
  EXPECT_EQ(background.still[4], (std::vector<char>{1, 1, 0}));
  const Features kept = without_still(features[4], background.still[4]);
  ASSERT_EQ(kept.keypoints.size(), 1U);
  EXPECT_EQ(kept.keypoints[0].x(), 209.0);
  EXPECT_EQ(kept.descriptors, std::vector<Descriptor>{outline});
  EXPECT_EQ(kept.keypoint_of, std::vector<int>{0});
}

TEST(StaticBackground, matches_that_stay_are_dropped_and_those_that_move_kept) {
  Features a, b;
  a.width = a.height = b.width = b.height = 400;
  a.keypoints = {{10, 10}, {50, 50}, {90, 90}};
  b.keypoints = {{13, 10}, {53.5, 50}, {90, 90}};
  std::vector<Match> matches{{0, 0}, {1, 1}, {2, 2}};
  drop_still_matches(matches, a, b, {3, 0}, {});
  EXPECT_EQ(matches, (std::vector<Match>{{2, 2}}));
}

// The whole way of a capture from features to cameras.
void expect_exact_cameras(const Orbit& capture, Motion motion) {
  std::vector<Features> features = features_of(capture);
  const StaticBackground background = background_of(features);
  ASSERT_TRUE(all_are(background, motion));
  Scene scene = capture.scene;
  for (std::size_t v = 0; v < features.size(); ++v) {
    if (motion == Motion::turn) features[v] = without_still(features[v], background.still[v]);
    scene.views[v].keypoints = features[v].keypoints;
  }
  const std::vector<int> pass_of(features.size(), 0);
  auto pairs = find_correspondences(features, {.pass_of = pass_of}, background, {}, silent);
  const auto summary = reconstruct(scene, std::move(pairs), {}, silent);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->registered, 24);
  EXPECT_LT(largest_centre_error(capture, scene), 0.012);
  EXPECT_NEAR(scene.cameras[0].fx, capture.camera.fx, 0.01 * capture.camera.fx);
}

TEST(StaticBackground, without_it_the_cameras_of_a_turn_are_exact) {
  expect_exact_cameras(make_turn(700, 500), Motion::turn);
}

TEST(StaticBackground, the_cameras_of_a_turn_before_a_plain_background_are_exact) {
  expect_exact_cameras(make_turn(0, 0), Motion::orbit);
}

}  // namespace
}  // namespace gyre
