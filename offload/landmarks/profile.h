// SPDX-License-Identifier: Apache-2.0
// The landmarks on a face's midline, from its profile.
#pragma once

#include "offload/landmarks/face_frame.h"

#include <map>
#include <string>
#include <vector>

namespace gyre {

// A point of the midline, metres in the face's frame, with standard deviations along the profile and across it.
struct ProfileMark {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double along = 0.002, across = 0.0015;
};

struct FaceProfile {
  std::map<std::string, ProfileMark> marks;    // noseTip, sellion, noseBase, upperLip, lowerLip, chin
  std::map<std::string, std::string> missing;  // the others, and why
  double mouth = 0.0;                          // y of the line between the lips; 0: not found
};

// noseTip is the point farthest out, sellion the deepest one between brow and nose, noseBase the deepest between nose
// and lip, the lips' points are farthest out, the chin is the point farthest along the direction half way between
// forward and down (gnathion). `points` are in the world; sizes follow the stature (metres) within wide bounds.
FaceProfile read_profile(const FaceFrame& frame, const std::vector<Eigen::Vector3d>& points, double stature);

}  // namespace gyre
