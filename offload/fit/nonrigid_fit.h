// SPDX-License-Identifier: Apache-2.0
// The fine fit: every vertex of the body moves towards the cloud, held by the edge Laplacian.
#pragma once

#include "common/log/log.h"
#include "offload/body/template.h"
#include "offload/fit/correspondences.h"
#include "offload/fit/landmark_targets.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

struct NonrigidFitOptions {
  double first_stiffness = 10.0;  // l_reg goes from this ...
  double last_stiffness = 1e-2;   // ... to this, in equal ratios, a factorisation each
  int steps = 6;
  double first_landmark_share = 0.1;  // l_lm goes from this ...
  double last_landmark_share = 1e-2;  // ... to this; what slides along the surface is held by the landmarks alone
  int searches = 3;                   // new correspondences a step
  int turns = 2;                      // rotations and vertices in turn, a search
  double membrane = 0.03;             // metres, of EdgeLaplacian
  double points_per_vertex = 2.0;
  double first_radius = 0.06;  // metres; gate of the correspondences at the first step ...
  double last_radius = 0.02;   // ... and at the last
  double min_cosine = 0.6;     // between the normals
  double max_slide = 0.015;    // metres; see match_vertices
  double hand_weight = 0.1;    // clouds of fingers are not to be relied on
  // Factors of the stiffness where the template has details that clouds do not show one by one.
  double hand_stiffness = 30.0;
  double foot_stiffness = 10.0;
  double head_stiffness = 3.0;      // and face
  double opening_stiffness = 30.0;  // around eyes, mouth and nostrils, up to twice opening_reach
  double opening_weight = 0.15;     // of the cloud within opening_reach, growing to 1 at twice that
  double opening_reach = 0.006;     // metres from what the lids, lips and nostrils hide
  int threads = 0;
};

struct NonrigidFit {
  std::vector<Eigen::Vector3d> vertices;  // of the whole template; only the body part's have moved
  // Per template vertex, in [0, 1]: the weight of the counterparts it had at the end, as a share of what a vertex in a
  // clean, complete cloud has; 0: none, it lies where the template puts it.
  std::vector<double> support;
};

// E(x) = l_lm E_lm + E_close + l_reg E_reg of Wenninger et al. 2020, by block-coordinate descent over correspondences,
// edge rotations and vertices. reference: the coarse result Xbar, posed vertices of the whole template; start: the
// vertices to begin with. Parts other than the body, and inner vertices of the body, have no data; the latter follow
// their surroundings. `outer` may be a part of the outer surface. held: empty, or a share in [0, 1] a vertex by which
// it stays where it starts.
//
// Correspondences change weights, and weights the matrix. So that a step can keep its factorisation, E_close is
// replaced by a bound that touches it at the vertices x0 of the moment (majorisation): with the weight W_v a vertex had
// when the step began, W_v |x_v - x0_v - min(1, w_v / W_v) d_v|^2, w_v and d_v its weight and mean residual now, a
// match's weight shared among its corners by their barycentric weights (Jensen). Both have the same slope at x0, hence
// the same minimum.
NonrigidFit fit_nonrigid(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<LandmarkTarget>& landmarks, const std::vector<Eigen::Vector3d>& reference,
                         const std::vector<Eigen::Vector3d>& start, std::span<const double> held = {},
                         const NonrigidFitOptions& options = {}, const Progress& progress = {});

}  // namespace gyre
