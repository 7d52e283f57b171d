// SPDX-License-Identifier: Apache-2.0
// Small shifts within each photograph that bring it onto what the photographs agree on.
#pragma once

#include "offload/texture/observations.h"
#include "offload/texture/photo.h"

#include <span>
#include <vector>

namespace gyre {

struct AlignOptions {
  int size = 1024;            // texels a side of the common picture
  int views = 16;             // photographs it is the mean of, at each triangle
  int grid = 12;              // pixels between the nodes that carry a shift
  double most = 8.0;          // pixels a shift may have
  double least_detail = 4.0;  // squared grey levels a pixel: less says nothing about a shift
};

// The subject sways and the fitted surface is not quite the true one, so that photographs disagree by some pixels about
// where things are. Renders the mean of each triangle's best photographs (texture coordinates of the mesh) into every
// photograph's camera, finds the optical flow to the photograph (Kroeger et al., ECCV 2016), and keeps of it a grid of
// shifts, weighed by the detail there (as Zhou and Koltun, SIGGRAPH 2014, warp photographs by a grid). A photograph
// that would not come nearer to the mean keeps none. A shift never leads nearer to a depth edge than the limits allow.
// The colours of `photos` must be in the common exposure; `surface` looks at the same photographs. Sets Photo::shift.
void align_photos(const PhotographedSurface& surface, const ObservationTable& table, const AlignOptions& options,
                  int threads, std::span<Photo> photos);

}  // namespace gyre
