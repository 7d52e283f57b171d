// SPDX-License-Identifier: Apache-2.0
// Where each photograph was taken from, as seen by a subject that did not stand quite still.
#pragma once

#include "common/geometry/pose.h"
#include "offload/texture/depth_map.h"
#include "offload/texture/observations.h"
#include "offload/texture/photo.h"

#include <span>
#include <vector>

namespace gyre {

struct PlaceOptions {
  int rounds = 8;             // at most
  double settled = 0.0002;    // metres, root mean square over the photographs: less is no motion
  int size = 1024;            // texels a side of the common picture
  int views = 48;             // photographs it is the mean of at each triangle; many, so that their sway cancels
  double shift = 0.01;        // metres the subject may have moved, one standard deviation
  double turn = 0.01;         // radians the subject may have turned
  double least_detail = 4.0;  // grey levels a pixel: of a gradient that counts half
  double edge_margin = 3.0;   // pixels, of the halved photograph, that are left out along depth edges
};

// The subject moved as a whole between photographs: by some millimetres, about its middle. Finds that motion for each
// photograph from the optical flow between the photographs' mean and itself (as align_photos does for what is left
// within it), by least squares over the flow along the picture's gradients with Huber weights and a prior on the
// motion, and again with the mean of the photographs so placed
// until they have settled. Works on photographs of half the size. Returns
// cam_from_world of each photograph as if the subject had stood still. normals: one a triangle, unit.
std::vector<Pose> place_views(const TriangleMesh& mesh, std::span<const Eigen::Vector3d> normals,
                              std::span<const std::uint8_t> skip, std::span<const Photo> photos,
                              const SightOptions& sight, const ViewLimits& limits, const PlaceOptions& options,
                              int threads);

}  // namespace gyre
