// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/placed_board.h"

#include "common/board/board.h"
#include "offload/cameras/world_frame.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

// Any frame a reconstruction may come in; its unit is 2.7 metres long.
Similarity arbitrary() {
  return {0.37, Eigen::Quaterniond(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized())), {3, -1, 7}};
}

// World of a point of the board that lies on the floor (z into the sheet points down), turned by 0.4, in front of the
// subject.
Eigen::Vector3d world_from_board(const Eigen::Vector3d& p) {
  const Eigen::Vector3d lying(p.x(), -p.z(), p.y());
  return Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()) * lying + Eigen::Vector3d(0.1, 0, 0.7);
}

// The board as every second camera of the orbit sees it.
std::vector<std::vector<BoardCorner>> project_board(const Orbit& orbit, double noise, unsigned seed = 1) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<std::vector<BoardCorner>> seen(orbit.cam_from_world.size());
  for (std::size_t v = 0; v < seen.size(); v += 2) {
    for (int i = 0; i < board_corner_count; ++i) {
      const Eigen::Vector2d place = board_corner(i);
      const auto pixel = orbit.camera.project(orbit.cam_from_world[v] * world_from_board({place.x(), place.y(), 0}));
      if (pixel) seen[v].push_back({i, *pixel + noise * Eigen::Vector2d(normal(engine), normal(engine))});
    }
  }
  return seen;
}

Scene moved_scene(const Orbit& orbit) {
  Scene scene = true_scene(orbit);
  move_world(scene, arbitrary());
  return scene;
}

TEST(PlacedBoard, gives_the_exact_scale_place_and_up) {
  const Orbit orbit = make_orbit();
  const auto board = place_board(moved_scene(orbit), project_board(orbit, 0));
  ASSERT_TRUE(board);
  EXPECT_NEAR(board->scale * arbitrary().scale, 1, 1e-6);
  EXPECT_LT(board->uncertainty, 0.002);
  EXPECT_EQ(board->corners, board_corner_count);
  EXPECT_EQ(board->views, 12);
  const Eigen::Vector3d centre = arbitrary() * world_from_board({board_width / 2, board_height / 2, 0});
  EXPECT_LT((board->centre - centre).norm(), 1e-6);
  EXPECT_GT(board->normal.dot(arbitrary().rotation * Eigen::Vector3d::UnitY()), 1 - 1e-9);
}

TEST(PlacedBoard, noise_stays_within_the_uncertainty) {
  const Orbit orbit = make_orbit();
  const Scene scene = moved_scene(orbit);
  int within_one = 0, within_two = 0;
  constexpr int trials = 100;
  for (unsigned seed = 0; seed < trials; ++seed) {
    const auto board = place_board(scene, project_board(orbit, 0.3, seed));
    ASSERT_TRUE(board);
    const double error = std::abs(board->scale * arbitrary().scale - 1);
    EXPECT_LT(error, 3 * board->uncertainty);
    EXPECT_LT(board->uncertainty, 0.006);
    within_one += error < board->uncertainty ? 1 : 0;
    within_two += error < 2 * board->uncertainty ? 1 : 0;
  }
  EXPECT_GE(within_one, 65);
  EXPECT_GE(within_two, 94);
}

TEST(PlacedBoard, a_corner_misread_in_one_view_is_left_out_there) {
  const Orbit orbit = make_orbit();
  auto seen = project_board(orbit, 0);
  seen[4][2].pixel += Eigen::Vector2d(9, -6);
  const auto board = place_board(moved_scene(orbit), seen);
  ASSERT_TRUE(board);
  EXPECT_NEAR(board->scale * arbitrary().scale, 1, 1e-6);
  EXPECT_EQ(board->corners, board_corner_count);
}

TEST(PlacedBoard, a_corner_that_is_wrong_everywhere_is_left_out) {
  const Orbit orbit = make_orbit();
  auto seen = project_board(orbit, 0);
  for (std::size_t v = 0; v < seen.size(); v += 2)
    seen[v][3].pixel = *orbit.camera.project(orbit.cam_from_world[v] * world_from_board({0.13, 0.125, 0}));  // 1 cm off
  const auto board = place_board(moved_scene(orbit), seen);
  ASSERT_TRUE(board);
  EXPECT_NEAR(board->scale * arbitrary().scale, 1, 1e-6);
  EXPECT_EQ(board->corners, board_corner_count - 1);
}

TEST(PlacedBoard, is_nowhere_when_too_little_is_seen) {
  const Orbit orbit = make_orbit();
  const Scene scene = moved_scene(orbit);
  const auto all = project_board(orbit, 0);
  EXPECT_FALSE(place_board(scene, std::vector<std::vector<BoardCorner>>(all.size())));
  auto two_views = all;
  for (std::size_t v = 4; v < all.size(); ++v) two_views[v].clear();
  EXPECT_FALSE(place_board(scene, two_views));
  auto three_corners = all;
  for (auto& corners : three_corners) corners.resize(std::min<std::size_t>(corners.size(), 3));
  EXPECT_FALSE(place_board(scene, three_corners));
  // Markers of something else, here and there.
  auto scattered = project_board(orbit, 60);
  EXPECT_FALSE(place_board(scene, scattered));
  Scene unplaced = scene;
  for (View& view : unplaced.views) view.registered = false;
  EXPECT_FALSE(place_board(unplaced, all));
}

// What the world of the orbit is, as find_world sees it when the stature given is wrong by a tenth.
struct Found {
  WorldFrame world;
  Similarity world_from_truth;
};
Found find(const Scene& scene, KnownLengths known) {
  known.stature = 1.87;
  const auto world = find_world(scene, known);
  EXPECT_TRUE(world) << world.error().message();
  return world ? Found{*world, world->world_from_model * arbitrary()} : Found{};
}

TEST(Scale, rests_on_board_then_turntable_then_height) {
  const Orbit orbit = make_orbit();
  const Scene scene = moved_scene(orbit);
  KnownLengths known;
  const Found by_height = find(scene, known);
  EXPECT_EQ(name_of(by_height.world.scale_source), "height");
  EXPECT_NEAR(by_height.world_from_truth.scale, 1.1, 0.005);
  EXPECT_NEAR(by_height.world.height, 1.87, 1e-12);
  known.stature_assumed = true;
  const Found by_assumption = find(scene, known);
  EXPECT_EQ(name_of(by_assumption.world.scale_source), "assumed-height");
  EXPECT_NEAR(by_assumption.world.height, 1.87, 1e-12);
  EXPECT_GT(by_assumption.world.scale_uncertainty, 0.05);

  known.turntable_radius = 2.4;
  const Found by_turntable = find(scene, known);
  EXPECT_EQ(name_of(by_turntable.world.scale_source), "turntable-radius");
  EXPECT_NEAR(by_turntable.world.ring_radius, 2.4, 1e-9);
  // The hand sways by 5 cm in 2.4 m.
  EXPECT_NEAR(by_turntable.world_from_truth.scale, 1.0, 0.02);
  EXPECT_NEAR(by_turntable.world.scale_uncertainty, 0.05 / 2.4, 0.015);

  known.board = place_board(scene, project_board(orbit, 0));
  const Found by_board = find(scene, known);
  EXPECT_EQ(name_of(by_board.world.scale_source), "board");
  EXPECT_NEAR(by_board.world_from_truth.scale, 1.0, 1e-6);
  EXPECT_NEAR(by_board.world.height, 1.7, 0.01);
  EXPECT_NEAR(by_board.world.height, 1.7, 2 * 1.7 * by_board.world.height_uncertainty);
  EXPECT_NEAR(by_board.world.ring_radius, 2.4, 0.05);
  EXPECT_NEAR(by_board.world.box.max().y(), 1.05 * by_board.world.height, 1e-9);
}

TEST(Scale, of_an_even_ring_is_exact) {
  Orbit orbit = make_orbit();
  Scene scene = true_scene(orbit);
  // A turntable's camera: the same distance and height in every view.
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const double angle = 2 * 3.14159265358979 * static_cast<double>(v) / static_cast<double>(scene.views.size());
    Pose& pose = scene.views[v].cam_from_world;
    pose.rotation = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(-angle - 3.14159265358979, Eigen::Vector3d::UnitY());
    pose.translation = -(pose.rotation * Eigen::Vector3d(2.4 * std::sin(angle), 1.3, 2.4 * std::cos(angle)));
  }
  move_world(scene, arbitrary());
  KnownLengths known;
  known.turntable_radius = 2.4;
  const Found found = find(scene, known);
  EXPECT_NEAR(found.world_from_truth.scale, 1.0, 1e-3);
  EXPECT_LT(found.world.scale_uncertainty, 1e-3);
}

TEST(Scale, that_makes_no_person_is_not_used) {
  const Orbit orbit = make_orbit();
  const Scene scene = moved_scene(orbit);
  KnownLengths known;
  known.board = place_board(scene, project_board(orbit, 0));
  ASSERT_TRUE(known.board);
  known.board->scale *= 3;
  known.turntable_radius = 0.2;
  EXPECT_EQ(find(scene, known).world.scale_source, ScaleSource::height);
}

TEST(Floor, is_where_the_board_lies_when_nothing_else_shows_it) {
  OrbitOptions options;
  options.floor_points = 0;
  options.room_points = 0;
  const Orbit orbit = make_orbit(options);
  const Scene scene = moved_scene(orbit);
  KnownLengths known;
  known.board = place_board(scene, project_board(orbit, 0));
  const Found found = find(scene, known);
  EXPECT_TRUE(found.world.has_floor);
  EXPECT_NEAR(found.world_from_truth.translation.y(), 0, 1e-3);
  EXPECT_LT(std::acos(std::min(1.0, (found.world_from_truth.rotation * Eigen::Vector3d::UnitY()).y())), 0.01 * degree);
  // A board on a wall says nothing of the floor, nor does one on a table.
  known.board->normal = arbitrary().rotation * Eigen::Vector3d::UnitX();
  EXPECT_FALSE(find(scene, known).world.has_floor);
  known.board = place_board(scene, project_board(orbit, 0));
  known.board->centre += arbitrary().rotation * Eigen::Vector3d(0, 0.37 * 0.7, 0);
  EXPECT_FALSE(find(scene, known).world.has_floor);
}

}  // namespace
}  // namespace gyre
