// SPDX-License-Identifier: Apache-2.0
// The coarse cage of the built-in human: trunk sections, swept limbs, and their texture charts.
#pragma once

#include "offload/body/cage.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// A point of the surface.
struct CagePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d centre;       // of its ring: what girth grows away from
  std::map<int, double> bones;  // skin weights by humanoid bone
  BodyRegion region;
};

struct HumanCage {
  std::vector<CagePoint> points;
  std::vector<CageFace> faces;
  std::vector<int> mirror;                        // one a point
  std::map<std::string, std::vector<int>> rings;  // points of the left half by what a joint or landmark calls them
};

// A closed cage of a person of 1.7 m with the arms 45 degrees down, made for two steps of subdivide(). Left and right
// mirror each other exactly.
HumanCage human_cage();

}  // namespace gyre
