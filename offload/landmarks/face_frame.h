// SPDX-License-Identifier: Apache-2.0
// Where a face is in the cloud and how it is turned.
#pragma once

#include "offload/landmarks/figure.h"

#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace gyre {

// A nose found on the head: the only thing on a head that falls off to both sides, below and above alike within two
// centimetres.
struct FaceFrame {
  // Origin at the tip of the nose; x towards the subject's left, y up, z out of the face. The plane x = 0 is the one
  // the face is most symmetric about; z is horizontal.
  Eigen::Isometry3d world_from_face = Eigen::Isometry3d::Identity();
  double score = 0.0;      // how much the nose stands out, in metres; noses score about 0.01, a smooth head about 0
  double asymmetry = 0.0;  // rms distance of the face from its mirror image, metres
};

// Points of the head (levels above 0.82) whose normals do not look away from a direction: through a hole at the back of
// a head the face is seen from inside.
std::vector<Eigen::Vector3d> head_points(const Figure& figure, const PointCloud& cloud, const Eigen::Vector3d& towards);

// Looks for a face towards +across (side 0 would be the subject's left) or away from there, turned by up to 40 degrees
// from that. Nothing when no place of the head looks like a nose.
std::optional<FaceFrame> find_face(const Figure& figure, const PointCloud& cloud, bool towards_across);

// Turns and shifts the frame so that the plane x = 0 mirrors the face onto itself (point-to-plane ICP of the points
// with their mirror image, after Combes et al., "Automatic symmetry plane estimation of bilateral objects in point
// clouds", CVPR 2008); yaw, roll and sideways place follow, height and pitch stay.
void refine_symmetry(FaceFrame& frame, const std::vector<Eigen::Vector3d>& head);

}  // namespace gyre
