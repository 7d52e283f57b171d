// SPDX-License-Identifier: Apache-2.0
// Eyes in a face map.
#pragma once

#include "offload/landmarks/face_map.h"

#include <array>
#include <string>

namespace gyre {

// The opening between the lids: two parabolas that meet in the corners. Places in the face's frame, metres.
struct EyeOpening {
  Eigen::Vector2d inner = Eigen::Vector2d::Zero(), outer = Eigen::Vector2d::Zero();
  double upper = 0.0, lower = 0.0;  // heights of the lids over and under the middle of the line between the corners

  Eigen::Vector2d upper_lid() const { return 0.5 * (inner + outer) + Eigen::Vector2d(0, upper); }
  Eigen::Vector2d lower_lid() const { return 0.5 * (inner + outer) - Eigen::Vector2d(0, lower); }
};

struct Eyes {
  std::array<EyeOpening, 2> eye;  // left (at positive x), right
  double deviation = 0.0;         // of a corner, metres
};

// Irises are found as dark discs of the size human irises have (11.7 mm across within a tenth, all ages) between
// brighter sides (after Daugman, "High confidence visual recognition of persons by a test of statistical
// independence", PAMI 1993), then the openings as deformable templates (Yuille, Hallinan and Cohen, "Feature extraction
// from faces using deformable templates", IJCV 1992) that hold what is unlike skin. Both eyes are fitted as mirror
// images first. `scale`: stature over 1.7 m. The error is why there are none.
tl::expected<Eyes, std::string> find_eyes(const FaceMap& map, double scale);

}  // namespace gyre
