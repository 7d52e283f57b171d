// SPDX-License-Identifier: Apache-2.0
// The fine fit: every vertex of the body moves towards the cloud, held by the edge Laplacian.
#pragma once

#include "common/log/log.h"
#include "offload/body/template.h"
#include "offload/fit/correspondences.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

struct NonrigidFitOptions {
  double first_stiffness = 10.0;  // l_reg goes from this ...
  double last_stiffness = 1e-2;   // ... to this, in equal ratios
  int steps = 6;
  int searches = 3;       // new correspondences a step
  int turns = 2;          // rotations and vertices in turn, a search
  double membrane = 3.0;  // of EdgeLaplacian
  double points_per_vertex = 2.0;
  double first_radius = 0.06;  // metres; gate of the correspondences at the first step ...
  double last_radius = 0.02;   // ... and at the last
  double min_cosine = 0.6;     // between the normals
  double max_slide = 0.015;    // metres; see match_vertices
  double hand_weight = 0.1;    // clouds of fingers are not to be relied on
  // Factors of the stiffness where the template has details that clouds do not show one by one.
  double hand_stiffness = 30.0;
  double foot_stiffness = 10.0;
  double head_stiffness = 3.0;  // and face
  int threads = 0;
};

struct NonrigidFit {
  std::vector<Eigen::Vector3d> vertices;  // of the whole template; only the body part's have moved
  std::vector<bool> supported;            // per template vertex: it had a counterpart at the end
};

// start: posed vertices of the whole template. Parts other than the body, and inner vertices of the body, have no data;
// the latter follow their surroundings.
NonrigidFit fit_nonrigid(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<Eigen::Vector3d>& start, const NonrigidFitOptions& options = {},
                         const Progress& progress = {});

}  // namespace gyre
