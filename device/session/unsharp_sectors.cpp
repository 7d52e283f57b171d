// SPDX-License-Identifier: Apache-2.0
#include "device/session/unsharp_sectors.h"

#include <algorithm>
#include <iterator>
#include <string>

namespace gyre {

namespace {

bool lies_in(const FramePlace& place, const UnsharpSector& sector) {
  return place.azimuth && place.band == sector.band && CoverageMap::sector_of(*place.azimuth) == sector.sector;
}

}  // namespace

std::vector<UnsharpSector> unsharp_sectors(const CoverageMap& map, std::string_view pass) {
  std::vector<UnsharpSector> sectors;
  for (const Band band : bands_of(pass)) {
    for (const int sector : map.unsharp(band)) sectors.push_back({band, sector});
  }
  return sectors;
}

void keep_least_bad(Selection& selection, std::span<const UnsharpSector> sectors, std::span<const FramePlace> places,
                    const std::function<bool(int)>& is_kept) {
  for (const UnsharpSector& sector : sectors) {
    std::optional<int> best;
    bool has_keyframe = false;
    for (std::size_t i = 0; i < places.size() && !has_keyframe; ++i) {
      if (!lies_in(places[i], sector)) continue;
      has_keyframe = selection.decisions[i].keyframe;
      const bool is_better = !best || places[i].quality > places[static_cast<std::size_t>(*best)].quality;
      if (is_better && is_kept(static_cast<int>(i))) best = static_cast<int>(i);
    }
    if (has_keyframe || !best) continue;
    const auto at = std::lower_bound(selection.keyframes.begin(), selection.keyframes.end(), *best);
    const auto order = std::distance(selection.keyframes.begin(), at);
    selection.keyframes.insert(at, *best);
    selection.neighbourhoods.insert(selection.neighbourhoods.begin() + order, {*best});
    selection.decisions[static_cast<std::size_t>(*best)] = {
        true, "Least bad of a sector (" + std::string(name_of(sector.band)) + ", " + std::to_string(sector.sector) +
                  ") in which no frame is sharp."};
  }
}

}  // namespace gyre
