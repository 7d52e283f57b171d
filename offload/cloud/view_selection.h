// SPDX-License-Identifier: Apache-2.0
// Which neighbours a view is matched against.
#pragma once

#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <span>
#include <vector>

namespace gyre {

struct ViewSelectionOptions {
  int count = 8;                 // neighbours a view at most
  double min_angle_deg = 3.0;    // triangulation angle below which depth is too uncertain
  double best_angle_deg = 10.0;  // where the score peaks
  double max_angle_deg = 30.0;   // above which patches look too different
};

// For each view, indices of its neighbours, best first; fewer than `count`, or none, where nothing suitable exists.
// The score of a pair is the sum over points on the surface of a slim upright cylinder in the region that face both
// cameras and lie in both pictures, of w(angle) * (finer / coarser sampling), w a Gaussian about best_angle_deg with a
// narrow side below it (as MVSNet, Yao et al., ECCV 2018, section 4.1, without needing sparse points).
// Views whose flag in `use` is 0 neither get neighbours nor become them.
std::vector<std::vector<int>> select_neighbours(std::span<const StereoView> views, const std::vector<char>& use,
                                                const SubjectRegion& region, const ViewSelectionOptions& options);

}  // namespace gyre
