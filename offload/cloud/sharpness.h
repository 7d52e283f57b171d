// SPDX-License-Identifier: Apache-2.0
// Views blurred by motion or focus, and which of them the others make superfluous.
#pragma once

#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <span>
#include <vector>

namespace gyre {

// Share of the fine detail a view of its pass usually has about the subject: about 1 for a sharp view, less for a
// blurred one, 1 where nothing can be said. Fine detail is the energy of the grey gradient at the working size over
// that at half of it: blur takes the first before the second, and what is seen has little influence on their ratio.
// Compared are the pixels whose rays meet the middle of the region, with the median over the views of the same pass and
// size.
std::vector<double> relative_sharpness(std::span<const StereoView> views, const SubjectRegion& region, int threads);

struct BlurOptions {
  double sharp = 0.75;          // relative sharpness from which a view counts as sharp
  int replacements = 4;         // sharp views that must see a place instead of a blurred one
  double max_angle_deg = 30.0;  // between their directions and the blurred view's
};

// 1 for views to use. A blurred one is left out when each place of the subject's stand-in (see proxy_surface) that it
// sees is also seen by `replacements` sharp views, from nearly the same side unless it only looks along the surface;
// where there are none it stays.
std::vector<char> views_to_use(std::span<const StereoView> views, const SubjectRegion& region,
                               const std::vector<double>& sharpness, const BlurOptions& options);

}  // namespace gyre
