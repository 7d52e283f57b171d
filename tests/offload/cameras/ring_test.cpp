// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/ring.h"

#include "offload/cameras/world_frame.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

TEST(Ring, of_a_whole_walk_is_closed) {
  const Ring ring = find_ring(true_scene(make_orbit()));
  EXPECT_TRUE(ring.closed);
  EXPECT_DOUBLE_EQ(ring.covered, 360 * degree);
  EXPECT_LT(ring.largest_gap, 20 * degree);
}

TEST(Ring, of_three_quarters_is_open_wherever_they_begin) {
  OrbitOptions options;
  options.arc = 270 * degree;
  const Orbit orbit = make_orbit(options);
  for (const double yaw : {0.0, 40.0, 170.0, 300.0}) {
    Scene scene = true_scene(orbit);
    move_world(scene, {1.0, Eigen::Quaterniond(Eigen::AngleAxisd(yaw * degree, Eigen::Vector3d::UnitY())), {0, 0, 0}});
    const Ring ring = find_ring(scene);
    EXPECT_FALSE(ring.closed);
    // The last of the views stands one step before the arc's end.
    EXPECT_NEAR(ring.covered, 270 * degree * 23 / 24, 4 * degree);
    EXPECT_NEAR(ring.largest_gap, 360 * degree - ring.covered, 1e-9);
  }
}

TEST(Ring, is_open_where_its_ends_are_not_linked) {
  // A point of the floor is seen all the way around, and would link the ends by that.
  Orbit orbit = make_orbit({.floor_points = 0});
  std::erase_if(orbit.pairs, [](const ViewPair& pair) { return pair.b - pair.a > 3; });
  const Ring ring = find_ring(true_scene(orbit));
  EXPECT_FALSE(ring.closed);
  EXPECT_LT(ring.largest_gap, 20 * degree);
}

TEST(Ring, does_not_count_close_ups) {
  OrbitOptions options;
  options.arc = 180 * degree;
  Scene scene = true_scene(make_orbit(options));
  const Scene close = true_scene(make_orbit({.radius = 0.6}));
  scene.views.insert(scene.views.end(), close.views.begin(), close.views.end());
  EXPECT_NEAR(find_ring(scene).covered, 180 * degree * 23 / 24, 4 * degree);
}

TEST(Ring, of_nothing_covers_nothing) {
  const Ring ring = find_ring({});
  EXPECT_FALSE(ring.closed);
  EXPECT_EQ(ring.covered, 0.0);
}

}  // namespace
}  // namespace gyre
