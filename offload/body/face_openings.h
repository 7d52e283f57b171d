// SPDX-License-Identifier: Apache-2.0
// The slits of a face: where two rims of one surface, the lids of an eye or the lips, meet.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <string>
#include <vector>

namespace gyre {

// The rim between the skin and its lining, split at the two corners. Each half runs from the corner at the smaller x of
// the mean shape to the other one and holds both.
struct FaceOpening {
  std::string name;  // "leftEye", "rightEye", "mouth"
  std::vector<int> upper, lower;
};

// The openings of a template whose body has linings (region `inner`) in them: for each eye part the rim around it, and
// the rim nearest to the teeth. What a template lacks is missing.
std::vector<FaceOpening> find_face_openings(const BodyTemplate& body);

// Axes of an opening: from corner to corner, from the lower rim to the upper one, and out of the face. Unit,
// orthogonal.
struct OpeningFrame {
  Eigen::Vector3d across, up, out;
};
OpeningFrame opening_frame(const FaceOpening& opening, const std::vector<Eigen::Vector3d>& vertices);

// A rim vertex and the point of the other rim that lies at the same place between the corners.
struct RimPair {
  int vertex = 0;
  bool upper = false;             // the vertex lies on the upper rim
  std::array<int, 2> opposite{};  // ends of the segment of the other rim
  double weight = 0.0;            // of opposite[1]; opposite[0] has the rest
};

// One pair for every rim vertex but the corners, by their places along `frame.across`.
std::vector<RimPair> pair_rims(const FaceOpening& opening, const std::vector<Eigen::Vector3d>& vertices,
                               const OpeningFrame& frame);

// From the lower point of the pair to the upper one, metres. Its component along the frame's `up` is how far the
// opening stands open there; negative: the rims have crossed.
Eigen::Vector3d gap_of(const RimPair& pair, const std::vector<Eigen::Vector3d>& vertices);

}  // namespace gyre
