// SPDX-License-Identifier: Apache-2.0
// Which photograph each triangle is textured from.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/observations.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// A photograph a triangle may take, and what taking it costs (data term).
struct Candidate {
  int photo = 0;
  float cost = 0;
  ViewQuality quality = ViewQuality::none;
};

struct LabelOptions {
  double colour_tolerance = 40.0;  // encoded levels a view may differ from the others' median before it counts as wrong
  double disagreement = 1.0;       // cost of differing by the tolerance, against 1 for the worst against the best view
  double agreement = 0.5;          // share of the views that must agree within the tolerance for any to be believed
  double seam_length = 0.04;       // cost of every border edge
  double seam_colour = 1.5;        // cost of a border edge between black and white
  int sweeps = 2;                  // rounds over all photographs at most
  int candidates = 16;             // photographs a triangle may choose from
};

// Candidates of every triangle, cheapest first; only strict ones where there are any. The cost follows the recovered
// data term 1 - V of the seed paper with V the normalised score, plus a photo-consistency term against views that
// disagree with the median (Waechter et al., ECCV 2014, section 4.1, with a median for its mean shift).
// Where too few agree, the surface is not where the photographs look, and there is no candidate.
// The colours of `table` must already be in the common exposure.
std::vector<std::vector<Candidate>> label_candidates(const ObservationTable& table, const LabelOptions& options);

// Photograph of each triangle, -1 without candidates. Minimises data cost plus, at every shared edge between two
// photographs, the edge's colour difference (a metric over photographs), by alpha expansion (Boykov, Veksler and Zabih,
// PAMI 2001) from the cheapest labels, so the energy is never above theirs.
std::vector<int> choose_photos(std::span<const Eigen::Vector3d> vertices, std::span<const SharedEdge> edges,
                               const std::vector<std::vector<Candidate>>& candidates, std::span<const Photo> photos,
                               const LabelOptions& options);

}  // namespace gyre
