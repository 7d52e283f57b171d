// SPDX-License-Identifier: Apache-2.0
// The head by itself: placed by the face, which nothing covers, and not by the hair.
#pragma once

#include "offload/body/body_state.h"
#include "offload/fit/correspondences.h"
#include "offload/fit/landmark_targets.h"
#include "offload/fit/point_index.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

struct HeadAlignmentOptions {
  int iterations = 16;
  int cloud_points = 4000;     // around the head, thinned to about this many
  double first_radius = 0.05;  // metres; the gate shrinks from this ...
  double last_radius = 0.012;  // ... to this
  double min_cosine = 0.5;     // between the normals
  double slide_weight = 0.15;  // as in CoarseFitOptions, like the next four
  double hair_weight = 0.03;   // of cloud points outside of the skull
  double data_deviation = 0.004;
  double data_count = 300.0;
  double scale_deviation = 0.06;     // of the logarithm of the head's size against the body's
  double rotation_deviation = 0.15;  // radians
  double shift_deviation = 0.03;     // metres
  int threads = 0;
};

struct HeadAlignment {
  BodyState state;                        // with the head's identity and the turn of its joint
  std::vector<Eigen::Vector3d> vertices;  // posed, whole template, the head moved and the neck between
  double scale = 1.0;                     // of the head against the body's
};

// The part of the outer surface whose three corners all satisfy `keep`.
template <class F>
OuterSurface part_of_surface(const OuterSurface& outer, const F& keep) {
  OuterSurface part;
  for (const int v : outer.vertices)
    if (keep(v)) part.vertices.push_back(v);
  part.vertex_triangles.resize(outer.vertex_triangles.size());
  for (const Eigen::Vector3i& t : outer.triangles) {
    if (!keep(t[0]) || !keep(t[1]) || !keep(t[2])) continue;
    for (int k = 0; k < 3; ++k) part.vertex_triangles[t[k]].push_back(static_cast<int>(part.triangles.size()));
    part.triangles.push_back(t);
  }
  return part;
}

// The cloud's points no further than `reach` metres from the box around that part of the surface.
OrientedPoints points_near(const OrientedPoints& cloud, const OuterSurface& part,
                           const std::vector<Eigen::Vector3d>& vertices, double reach);

// Share of each vertex's skin weights that belongs to the head joint and those below it.
std::vector<double> head_shares(const BodyTemplate& body);

// Gauss-Newton on a similarity of the head about its joint and on the template's head identity space, from landmarks of
// the head and robust closest points of face and skull (the head fit of Wenninger et al. 2020: similarity, ICP with
// scale, head model). Points outside of the skull hardly count: they are hair. Without points or landmarks at the head,
// or without a head joint, everything stays as it is.
HeadAlignment align_head(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<LandmarkTarget>& landmarks, const BodyState& state,
                         const HeadAlignmentOptions& options = {});

}  // namespace gyre
