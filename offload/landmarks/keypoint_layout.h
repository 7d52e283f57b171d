// SPDX-License-Identifier: Apache-2.0
// Which keypoint of a whole-body network is which landmark.
#pragma once

#include "common/result/result.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace gyre {

// Indices into a network's keypoints; [0] is the subject's left.
struct KeypointLayout {
  int count = 0;
  std::array<int, 2> shoulder{}, ear{}, heel{}, toe{};
  std::array<int, 2> hand{};  // first of 21: wrist, then thumb, index, middle, ring, little, four each, tips last
  int face = 0;               // first of the 68 points of the iBUG scheme
  std::vector<std::pair<int, int>> bones;  // of the body
};

// "133": COCO-WholeBody (17 body, 6 feet, 68 face, 21 left hand, 21 right hand). "135": 25 body as in OpenPose's
// BODY_25, 21 left hand, 21 right hand, 68 face.
Result<KeypointLayout> keypoint_layout(const std::string& name);

}  // namespace gyre
