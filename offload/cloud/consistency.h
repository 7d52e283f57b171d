// SPDX-License-Identifier: Apache-2.0
// Which pixels of a depth map other views confirm, as oriented points.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <span>

namespace gyre {

struct ConfirmationOptions {
  int min_views = 3;                 // views that must agree, the pixel's own among them
  double max_relative_depth = 0.01;  // difference of depth over depth
  double max_pixels = 1.5;           // forward-backward reprojection error
  double max_normal_angle_deg = 40.0;
  double see_through = 0.02;       // a view whose surface lies this share of the depth behind a point sees through it
  int max_colour_difference = 18;  // levels in any channel, between a point's colours in two views
  float max_cost = 0.65F;          // matching cost of a pixel that may become a point
  double match_precision = 0.1;    // standard deviation of what all views get wrong alike, pixels on the surface
};

// Points of maps[reference] inside the region that at least min_views views confirm and that fewer views see through
// than confirm. A view only confirms a point that has the same colour there: a background pixel that was drawn to the
// subject's depth by its window shows another piece of background to each view. The depth of a point is the mean of
// what the confirming views' planes give along the pixel's ray (the consistency rules of Schönberger et al., ECCV 2016,
// section 4.4, and the free-space rule of Merrell et al., ICCV 2007). Confidence grows with the number of confirming
// views and the quality of the match. `others` are the views that may confirm.
//
// The deviation of a point along its normal has two parts. The confirming depths' sample standard deviation is what the
// views do not agree on; it is not divided by the root of their number, because neighbouring maps were made from the
// same pictures and err together. match_precision times the pixel's size on the surface, depth / (focal length * cosine
// of the view), is what they get wrong alike: windows of that size smooth what is curved.
PointCloud consistent_points(std::span<const StereoView> views, std::span<const StereoDepth> maps, int reference,
                             std::span<const int> others, const SubjectRegion& region,
                             const ConfirmationOptions& options);

}  // namespace gyre
