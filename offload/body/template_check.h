// SPDX-License-Identifier: Apache-2.0
// Looks for what is wrong with a template.
#pragma once

#include "offload/body/template.h"

#include <string>
#include <vector>

namespace gyre {

struct TemplateFinding {
  bool is_error = false;  // false: worth knowing
  std::string what;
};

// Checks that arrays match, the body is a closed, consistently oriented manifold, weights sum to 1, joints lie inside
// the surface (generalised winding number, Jacobson et al. 2013), mirror pairs mirror, texture coordinates lie in
// [0, 1] and do not overlap, every expression of ARKit and viseme is there and does what its name says, landmarks are
// there, and the rest pose is within the joints' ranges.
std::vector<TemplateFinding> check_template(const BodyTemplate& body);

// Boundary edges, edges of more than two triangles, and edges whose triangles disagree on the orientation.
struct EdgeReport {
  int open = 0, crowded = 0, flipped = 0;
  int euler = 0;  // V - E + F over the vertices in use; 2 for a sphere
};
EdgeReport check_edges(const std::vector<Eigen::Vector3i>& triangles);

// How often the triangles wind around a point: about 1 inside a closed surface, about 0 outside.
double winding_number(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles,
                      const Eigen::Vector3d& point);

}  // namespace gyre
