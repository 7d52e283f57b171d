// SPDX-License-Identifier: Apache-2.0
// A sphere over a floor in a distant room, all with a solid texture, and exact pictures of it.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre::test {

struct RayScene {
  Eigen::Vector3d centre = Eigen::Vector3d(0.0, 0.35, 0.0);
  double radius = 0.3;

  // Distance along the ray in units of `direction`, and whether it is the sphere that was met.
  struct Hit {
    double t = 0;
    bool sphere = false;
  };
  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  // CV_8UC3 as the camera sees it, distortion included, four rays a pixel.
  cv::Mat picture(const Camera& camera, const Pose& cam_from_world) const;

  // Box about the sphere; its lower side is the floor.
  SubjectRegion region() const;
};

// `count` poses on an arc about the y axis, `step_deg` apart, 1.2 m from the sphere and a little above it.
std::vector<Pose> arc(const RayScene& scene, int count, double step_deg);

// Views of the scene from an arc at the pictures' full size; the camera is `width` x 5/4 `width` pixels.
std::vector<StereoView> views_on_arc(const RayScene& scene, int count, double step_deg, int width);

// Exact depths and normals of a view; pixels that do not see the sphere are `beyond`.
StereoDepth true_depth(const RayScene& scene, const StereoView& view);

Camera test_camera(int width);

}  // namespace gyre::test
