// SPDX-License-Identifier: Apache-2.0
// The pieces of the hm08 human: which vertices of the sources each part of the template is made of.
#pragma once

#include "offload/body/makehuman.h"
#include "offload/body/template.h"

#include <string>
#include <vector>

namespace gyre {

// All parts in one mesh with one atlas: where each vertex comes from, triangles and texture coordinates (vertices are
// left empty).
struct AssembledParts {
  std::vector<TemplatePart> parts;
  std::vector<BoundPoint> binding;  // one a vertex
  TriangleMesh mesh;
  std::vector<int> mirror;     // known pairs; -1: not known here
  std::vector<bool> interior;  // of the mouth or an eye socket, not on its rim
};

// Body first, then leftEye, rightEye, upperTeeth, lowerTeeth, tongue, lashes. The small parts get space in the body's
// atlas rather than one of their own: an avatar is one mesh with one material and one picture then, which every
// importer reads and the texture stage bakes in one go. Helper geometry, joint cubes and genitals are left out.
Result<AssembledParts> assemble_parts(const Sources& sources);

// Positions of all vertices for positions of the base mesh.
std::vector<Eigen::Vector3d> bound_positions(const std::vector<BoundPoint>& binding,
                                             const std::vector<Eigen::Vector3f>& base);

// Offsets of all vertices for a target of the base mesh, vertices x 3.
Eigen::MatrixXd bound_offsets(const std::vector<BoundPoint>& binding, const Target& target);

}  // namespace gyre
