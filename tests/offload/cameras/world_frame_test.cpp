// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/world_frame.h"

#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

// Any frame a reconstruction may come in.
Similarity arbitrary() {
  return {0.37, Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized())), {3, -1, 7}};
}

TEST(WorldFrame, of_a_ring_is_the_true_one_up_to_the_yaw) {
  const Orbit orbit = make_orbit();
  Scene scene = true_scene(orbit);
  move_world(scene, arbitrary());
  const auto world = find_world(scene, {.stature = 1.7});
  ASSERT_TRUE(world) << world.error().message();
  EXPECT_TRUE(world->has_floor);
  const Similarity world_from_truth = world->world_from_model * arbitrary();
  EXPECT_NEAR(world_from_truth.scale, 1.0, 0.004);
  EXPECT_LT(std::acos((world_from_truth.rotation * Eigen::Vector3d::UnitY()).y()), 0.1 * degree);
  EXPECT_NEAR(world_from_truth.translation.y(), 0.0, 0.005);
  EXPECT_LT(std::hypot(world_from_truth.translation.x(), world_from_truth.translation.z()), 0.05);
  EXPECT_NEAR(world->ring_radius, 2.4, 0.05);
  for (std::size_t i = 0; i < 500; ++i) {
    const Eigen::Vector3d point = world_from_truth * orbit.points[i];
    EXPECT_TRUE(world->box.contains(point)) << point.transpose();
  }
}

TEST(WorldFrame, works_without_a_floor) {
  OrbitOptions options;
  options.floor_points = 0;
  options.room_points = 0;
  const Orbit orbit = make_orbit(options);
  Scene scene = true_scene(orbit);
  move_world(scene, arbitrary());
  const auto world = find_world(scene, {.stature = 1.7});
  ASSERT_TRUE(world) << world.error().message();
  EXPECT_FALSE(world->has_floor);
  EXPECT_NEAR((world->world_from_model * arbitrary()).scale, 1.0, 0.03);
}

TEST(WorldFrame, of_a_turn_before_a_camera_askew_has_the_axis_of_the_turn) {
  OrbitOptions options;
  options.motion = Motion::turn;
  options.floor_points = 0;
  options.room_points = 0;
  options.arc = 4.0;
  const Orbit orbit = make_orbit(options);
  Scene scene = true_scene(orbit);
  move_world(scene, arbitrary());
  const auto world = find_world(scene, {.stature = 1.7});
  ASSERT_TRUE(world) << world.error().message();
  EXPECT_FALSE(world->has_floor);
  const Similarity world_from_truth = world->world_from_model * arbitrary();
  EXPECT_NEAR(world_from_truth.scale, 1.0, 0.03);
  EXPECT_LT(std::acos((world_from_truth.rotation * Eigen::Vector3d::UnitY()).y()), 1e-4 * degree);
  EXPECT_LT(std::hypot(world_from_truth.translation.x(), world_from_truth.translation.z()), 1e-5);
  EXPECT_NEAR(world_from_truth.translation.y(), 0.0, 0.05);
}

TEST(WorldFrame, of_a_turn_has_no_floor_in_a_pair_of_shoes) {
  OrbitOptions options;
  options.motion = Motion::turn;
  options.floor_points = 0;
  options.room_points = 0;
  Scene scene = true_scene(make_orbit(options));
  // As many points as on the body, between 4 and 6 cm up, on two shoes; and their soles.
  const Track on_body = scene.tracks.front();
  for (int i = 0; i < 500; ++i) {
    Track track = on_body;
    track.triangulated = true;
    for (Observation& o : track.observations) o.used = true;
    track.point = {(i % 2 == 0 ? 0.13 : -0.13) + 0.04 * std::sin(7.0 * i), i < 20 ? 0.001 * (i % 4) : 0.04 + 4e-5 * i,
                   0.13 * std::sin(11.0 * i)};
    scene.tracks.push_back(track);
  }
  const auto world = find_world(scene, {.stature = 1.7});
  ASSERT_TRUE(world) << world.error().message();
  EXPECT_FALSE(world->has_floor);
  EXPECT_NEAR(world->world_from_model.scale, 1.0, 0.005);
  EXPECT_NEAR(world->world_from_model.translation.y(), 0.0, 0.005);
}

TEST(WorldFrame, an_empty_room_has_no_subject) {
  OrbitOptions options;
  options.body_points = 0;
  const Orbit orbit = make_orbit(options);
  const auto world = find_world(true_scene(orbit), {.stature = 1.7});
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().message().find("no subject"), std::string::npos);
}

TEST(WorldFrame, up_does_not_depend_on_pitch_and_bears_a_tilted_picture) {
  std::vector<Pose> poses;
  for (int i = 0; i < 12; ++i) {
    const double pitch = (i % 3) * 0.3;
    const double roll = i == 5 ? 0.6 : 0.0;
    // Camera axes from world axes: half a turn about x points y down.
    Pose pose;
    pose.rotation = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(0.4 * i, Eigen::Vector3d::UnitY());
    poses.push_back(pose);
  }
  EXPECT_GT(up_direction(poses).y(), std::cos(0.2 * degree));
}

TEST(WorldFrame, floor_level_is_the_lowest_crowded_one) {
  std::vector<double> heights;
  for (int i = 0; i < 300; ++i) heights.push_back(0.001 * (i % 7));   // floor
  for (int i = 0; i < 800; ++i) heights.push_back(0.7 + 0.0001 * i);  // a table
  for (int i = 0; i < 5; ++i) heights.push_back(-0.5 - 0.1 * i);      // false points
  const auto level = floor_level(heights, 0.02);
  ASSERT_TRUE(level);
  EXPECT_NEAR(*level, 0.003, 0.002);
  EXPECT_FALSE(floor_level(std::vector<double>{0.0, 0.001, 0.002}, 0.02));
}

TEST(WorldFrame, the_column_ends_below_the_ceiling) {
  std::vector<double> heights;
  for (int i = 0; i <= 400; ++i) heights.push_back(1.7 * i / 400);
  for (int i = 0; i < 50; ++i) heights.push_back(2.5 + 0.001 * i);
  heights.push_back(1.95);  // a false point on the way
  const auto top = column_top(heights, 0.0, 0.2);
  ASSERT_TRUE(top);
  EXPECT_NEAR(top->height, 1.7, 0.02);
}

}  // namespace
}  // namespace gyre
