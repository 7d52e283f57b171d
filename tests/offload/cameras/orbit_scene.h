// SPDX-License-Identifier: Apache-2.0
// A person-like column in a room, seen from a ring or turning before a fixed camera, as keypoints and matches with
// known truth.
#pragma once

#include "offload/cameras/features.h"
#include "offload/cameras/scene.h"

#include <cstdint>
#include <vector>

namespace gyre {

struct OrbitOptions {
  Motion motion = Motion::orbit;
  int views = 24;
  double arc = 2 * 3.14159265358979323846;  // radians of the ring that is walked
  double radius = 2.4;                      // metres
  int body_points = 500;
  int room_points = 700;
  int floor_points = 500;
  double pixel_noise = 0.3;           // standard deviation, pixels
  double outlier_share = 0.05;        // of the matches of a pair, replaced by random ones
  std::vector<Eigen::Vector3d> sway;  // metres by which the body is moved in each view; empty: it stands still
  Camera camera{.width = 720, .height = 1280, .fx = 1100, .fy = 1098, .cx = 357, .cy = 644, .k1 = -0.04, .k2 = 0.01};
  std::uint64_t seed = 1;
};

// Truth: world of design.md (metres, +Y up, floor y = 0, subject 1.7 m tall at the origin). In a turn the world turns
// with the subject, and room and floor, which do not, are only in the keypoints.
struct Orbit {
  Camera camera;
  std::vector<Pose> cam_from_world;
  std::vector<Eigen::Vector3d> points;
  Scene scene;                             // keypoints only; cameras have a size and nothing else
  std::vector<std::vector<int>> point_of;  // per view and keypoint
  std::vector<ViewPair> pairs;             // neighbours up to three apart and the closure of a full ring
};

Orbit make_orbit(const OrbitOptions& options = {});

// The keypoints of every view with descriptors that differ from point to point, and a little from view to view.
std::vector<Features> features_of(const Orbit& orbit);

// The scene registered and triangulated as it truly is.
Scene true_scene(const Orbit& orbit);

// Largest distance between true and reconstructed camera centres after similarity alignment, metres; views that are not
// registered are skipped.
double largest_centre_error(const Orbit& orbit, const Scene& scene);

}  // namespace gyre
