// SPDX-License-Identifier: Apache-2.0
// What of the subject has been seen sharply: azimuth by band.
#pragma once

#include "device/coverage/orbit.h"

#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace gyre {

enum class Band { body_upper, body_lower, head_ring, crown, chin };
inline constexpr std::array all_bands = {Band::body_upper, Band::body_lower, Band::head_ring, Band::crown, Band::chin};

// "body upper", "body lower", "head ring", "crown", "chin".
std::string_view name_of(Band band);

// Bands that a pass has to fill: body the two of the body, head the other three, turn the upper body.
std::vector<Band> bands_of(std::string_view pass);

// The band a camera is in. The body pass begins on its upper ring, the head pass on its ring; `before` is the band of
// the frame before, which a camera near the border stays in.
Band band_of(std::string_view pass, const OrbitPlace& place, std::optional<Band> before);

struct CoverageCell {
  double quality = 0.0;  // best sharpness against the sharpest frame nearby, 0 to 1
  int best_frame = -1;   // of that quality
  int sharp_frames = 0;
  bool is_covered() const { return sharp_frames > 0; }
};

// Belongs to one thread.
class CoverageMap {
 public:
  static constexpr int sectors = 24;  // of 15 degrees; the first begins where the pass began

  // azimuth: radians, any; quality: 0 to 1.
  void add(double azimuth, Band band, double quality, bool is_sharp, int frame);

  static int sector_of(double azimuth);
  const CoverageCell& cell(Band band, int sector) const;

  // Share of what the band needs, 0 to 1: all sectors of a ring; six sharp frames of crown and chin, wherever.
  double share(Band band) const;

  // Sectors without a sharp frame, ascending.
  std::vector<int> gaps(Band band) const;

  // Sectors that have been passed, all their frames unsharp: their least bad frame has to do.
  std::vector<int> unsharp(Band band) const;

 private:
  std::array<std::array<CoverageCell, sectors>, all_bands.size()> cells_;
};

}  // namespace gyre
