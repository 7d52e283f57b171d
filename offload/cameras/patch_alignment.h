// SPDX-License-Identifier: Apache-2.0
// Where a point that sharp pictures show lies in a blurred one.
#pragma once

#include "offload/cameras/scene.h"

#include <Eigen/Core>
#include <map>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace gyre {

struct PatchAlignmentOptions {
  int half_side = 12;     // of the compared patch, pixels of the resized pictures
  int reach = 10;         // farthest shift from the expected place, pixels of the resized pictures
  double max_smear = 40;  // by the motion of the camera, pixels of the resized pictures
  double min_correlation = 0.7;
  int points_per_cell = 6;  // of a 12 x 12 grid over the picture
};

struct AlignedPoint {
  int track = 0;
  Eigen::Vector2d pixel;  // in the blurred picture, full size
  double correlation = 0.0;
};

// How a camera moves while a picture is exposed, evenly and about the pose in the middle of the exposure.
struct CameraMotion {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // of the centre, world
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   // axis times angle, camera axes, radians

  // The pose at `t`, -0.5 at the beginning of the exposure and 0.5 at its end.
  Pose pose_at(double t, const Pose& cam_from_world) const;
};

// The pictures of one comparison, resized and smoothed as the options say.
struct PatchPictures {
  double scale = 1.0;
  cv::Mat picture;
  std::map<int, cv::Mat> references;       // by view
  std::map<int, Eigen::Vector3d> normals;  // of the surface at the points of tracks, as they are found out
};

// From 8-bit grey pictures.
PatchPictures prepare_patch_pictures(const cv::Mat& picture, const std::map<int, cv::Mat>& references, double scale,
                                     double smoothing);

// Looks in the picture, the one of `view`, for the surroundings of the tracks' points it must show by the given pose,
// as one of the references (registered views) shows them: the patch is carried over as if it were a plane that faces
// both cameras, and the place of the largest normalised cross-correlation, to parts of a pixel, is the answer. The blur
// of a steady motion is symmetric about the middle of the exposure, so this place is not shifted by it, as the ends of
// a smear that a detector finds are.
std::vector<AlignedPoint> align_patches(const Scene& scene, std::span<const int> tracks, int view,
                                        const Pose& cam_from_world, const CameraMotion& motion, PatchPictures& pictures,
                                        const PatchAlignmentOptions& options = {});

}  // namespace gyre
