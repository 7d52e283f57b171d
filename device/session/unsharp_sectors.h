// SPDX-License-Identifier: Apache-2.0
// Sectors that a pass has gone by without one sharp frame: their least bad one has to do.
#pragma once

#include "common/selection/selection.h"
#include "device/coverage/coverage_map.h"

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace gyre {

struct UnsharpSector {
  Band band = Band::body_upper;
  int sector = 0;
};

// Those of the bands that the pass has to fill.
std::vector<UnsharpSector> unsharp_sectors(const CoverageMap& map, std::string_view pass);

// Where a frame was taken from, and how sharp it is against the sharpest nearby, 0 to 1. Kept of every frame of a pass.
struct FramePlace {
  std::optional<float> azimuth;  // radians; nothing: not known
  float quality = 0.0F;
  Band band = Band::body_upper;
};

// Of every such sector that has no keyframe the best frame becomes one, among those that can be had (is_kept, by
// index). places: one a frame.
void keep_least_bad(Selection& selection, std::span<const UnsharpSector> sectors, std::span<const FramePlace> places,
                    const std::function<bool(int)>& is_kept);

}  // namespace gyre
