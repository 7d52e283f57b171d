// SPDX-License-Identifier: Apache-2.0
// What the photographs agree on that the surface looks like, and that as one camera sees it.
#pragma once

#include "common/render/rasterise.h"
#include "offload/texture/atlas.h"
#include "offload/texture/observations.h"
#include "offload/texture/photo.h"

#include <opencv2/core/mat.hpp>

namespace gyre {

// The mean of each triangle's best `views` photographs in the atlas' layout: 32-bit, grey levels, common exposure; -1
// where fewer than two see the surface. The photographs' colours are taken through their tone.
cv::Mat common_picture(const PhotographedSurface& surface, const ObservationTable& table, const Atlas& atlas,
                       std::size_t views, int threads);

// The photograph in the common exposure, 8-bit grey.
cv::Mat grey_of(const Photo& photo);

struct CommonView {
  cv::Mat picture;  // 8-bit grey, as large as the photograph
  cv::Mat known;    // 255 where the camera sees something of the common picture
  VisibilityBuffer seen;
};

// The common picture as the photograph's camera sees it, over `grey` (grey_of(photo)) where it sees nothing of it or
// is nearer than `margin` pixels to a depth edge.
CommonView render_common(const PhotographedSurface& surface, const Photo& photo, const DepthMap& depth,
                         const cv::Mat& picture, const cv::Mat& grey, double margin);

}  // namespace gyre
