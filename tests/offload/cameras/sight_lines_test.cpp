// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/sight_lines.h"

#include "offload/cameras/world_frame.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr double radius = 2.4;

// An orbit whose subject hides what is behind it, and wears something between two heights that shows no points.
Scene dark_subject(double low, double high) {
  const Orbit orbit = make_orbit({.room_points = 2000});
  Scene scene = true_scene(orbit);
  for (Track& track : scene.tracks) {
    const Eigen::Vector3d& p = track.point;
    if (std::hypot(p.x(), p.z()) < 0.3 && p.y() > low && p.y() < high) track.triangulated = false;
    for (Observation& o : track.observations) {
      const Eigen::Vector3d centre = centre_of(scene.view_of(o).cam_from_world), way = p - centre;
      const double t = -(centre.x() * way.x() + centre.z() * way.z()) / (way.x() * way.x() + way.z() * way.z());
      const Eigen::Vector3d passing = centre + t * way;
      if (t < 0.9 && std::hypot(passing.x(), passing.z()) < 0.16 && passing.y() < 1.7) o.used = false;
    }
  }
  return scene;
}

TEST(SightLines, tell_something_dark_from_air) {
  const Scene scene = dark_subject(0.3, 1.3);
  const std::vector<SightLine> lines = lines_past_axis(scene, {}, radius);
  EXPECT_TRUE(is_solid(lines, 0.3, 1.3, radius));
  EXPECT_TRUE(is_solid(lines, 0.8, 1.0, radius));
  EXPECT_FALSE(is_solid(lines, 1.7, 2.1, radius));
  EXPECT_FALSE(is_solid(lines, 1.3, 2.1, radius));
  EXPECT_FALSE(is_solid(lines, 5.0, 6.0, radius));  // where no line passes nothing is known
}

TEST(SightLines, the_height_of_somebody_in_dark_clothes_is_the_whole_one) {
  const auto world = find_world(dark_subject(0.3, 1.3), {.stature = 1.7});
  ASSERT_TRUE(world) << world.error().message();
  EXPECT_NEAR(world->world_from_model.scale, 1.0, 0.01);
}

}  // namespace
}  // namespace gyre
