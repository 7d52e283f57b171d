// SPDX-License-Identifier: Apache-2.0
// What structure from motion works on: cameras, views with their keypoints, and tracks of keypoints that match.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "offload/cameras/matching.h"
#include "offload/cameras/motion.h"

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

namespace gyre {

// One picture. Pixels as in common/geometry/camera.h; lengths in the unit of the reconstruction.
struct View {
  int camera = 0;  // index into Scene::cameras
  int pass = 0;    // which walk around the subject
  int order = 0;   // place in that walk
  Motion motion = Motion::orbit;
  std::vector<Eigen::Vector2d> keypoints;
  std::vector<double> sizes;                // standard deviation of the keypoint's Gaussian, pixels
  std::vector<int> track_of;                // per keypoint; -1: none
  std::vector<Eigen::Vector2d> normalised;  // keypoints without lens; see update_normalised
  bool registered = false;
  Pose cam_from_world;
};

struct Observation {
  int view = 0;
  int keypoint = 0;
  bool used = false;  // agrees with the track's point
};

// Keypoints of different views that are believed to show one point of the world.
struct Track {
  std::vector<Observation> observations;  // by view
  bool triangulated = false;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();

  int used_count() const;
};

// Two views and the keypoints that match by appearance and by epipolar geometry.
struct ViewPair {
  int a = 0;
  int b = 0;
  std::vector<Match> matches;
};

struct Scene {
  std::vector<Camera> cameras;
  std::vector<View> views;
  std::vector<Track> tracks;

  const Camera& camera_of(const View& view) const { return cameras[static_cast<std::size_t>(view.camera)]; }
  const View& view_of(const Observation& o) const { return views[static_cast<std::size_t>(o.view)]; }
  const Eigen::Vector2d& pixel_of(const Observation& o) const {
    return view_of(o).keypoints[static_cast<std::size_t>(o.keypoint)];
  }
  const Eigen::Vector2d& normalised_of(const Observation& o) const {
    return view_of(o).normalised[static_cast<std::size_t>(o.keypoint)];
  }
  int registered_count() const;
};

// Recomputes View::normalised of every view from its camera; to be called when a camera has changed.
void update_normalised(Scene& scene, int threads);

// Distance in pixels between the keypoint and the projected point; infinity behind the camera.
double reprojection_error(const Scene& scene, const Observation& observation, const Eigen::Vector3d& point);

// Root mean square over all used observations, pixels.
double mean_reprojection_error(const Scene& scene);

// Share of the pair's matches whose Sampson distance (Hartley and Zisserman, eq. 11.9) to the epipolar geometry of the
// two poses is below max_error pixels. Both views must be registered.
double epipolar_agreement(const Scene& scene, const ViewPair& pair, double max_error);

}  // namespace gyre
