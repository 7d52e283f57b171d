// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/coverage_map.h"

#include <algorithm>
#include <cmath>

namespace gyre {

std::string_view name_of(Band band) {
  switch (band) {
    case Band::body_upper:
      return "body upper";
    case Band::body_lower:
      return "body lower";
    case Band::head_ring:
      return "head ring";
    case Band::crown:
      return "crown";
    case Band::chin:
      return "chin";
  }
  return "";
}

std::vector<Band> bands_of(std::string_view pass) {
  if (pass == "head") return {Band::head_ring, Band::crown, Band::chin};
  if (pass == "turn") return {Band::body_upper};
  return {Band::body_upper, Band::body_lower};
}

Band band_of(std::string_view pass, const OrbitPlace& place, std::optional<Band> before) {
  if (pass == "turn") return Band::body_upper;
  // Borders lie between the rings; a camera has to be past one by `stay` to change.
  if (pass == "head") {
    constexpr double crown = 17.0 * M_PI / 180.0;
    constexpr double chin = -17.0 * M_PI / 180.0;
    constexpr double stay = 2.0 * M_PI / 180.0;
    const double over = place.elevation - crown + (before == Band::crown ? stay : -stay);
    const double under = chin - place.elevation + (before == Band::chin ? stay : -stay);
    return over > 0 ? Band::crown : under > 0 ? Band::chin : Band::head_ring;
  }
  constexpr double border = -0.18;  // heights of face and thighs differ by about 0.36 distances
  constexpr double stay = 0.03;
  return place.height < border + (before == Band::body_lower ? stay : -stay) ? Band::body_lower : Band::body_upper;
}

int CoverageMap::sector_of(double azimuth) {
  const double turns = azimuth / (2 * M_PI);
  return std::min(sectors - 1, static_cast<int>((turns - std::floor(turns)) * sectors));
}

const CoverageCell& CoverageMap::cell(Band band, int sector) const {
  return cells_[static_cast<std::size_t>(band)][static_cast<std::size_t>(sector)];
}

void CoverageMap::add(double azimuth, Band band, double quality, bool is_sharp, int frame) {
  CoverageCell& cell = cells_[static_cast<std::size_t>(band)][static_cast<std::size_t>(sector_of(azimuth))];
  if (is_sharp) ++cell.sharp_frames;
  if (cell.best_frame >= 0 && quality <= cell.quality) return;
  cell.quality = quality;
  cell.best_frame = frame;
}

double CoverageMap::share(Band band) const {
  const auto covered = static_cast<double>(static_cast<std::size_t>(sectors) - gaps(band).size());
  constexpr double enough = 6.0;
  const bool is_ring = band != Band::crown && band != Band::chin;
  if (is_ring) return covered / sectors;
  double frames = 0.0;
  for (int s = 0; s < sectors; ++s) frames += cell(band, s).sharp_frames;
  return std::min(1.0, frames / enough);
}

std::vector<int> CoverageMap::gaps(Band band) const {
  std::vector<int> gaps;
  for (int s = 0; s < sectors; ++s) {
    if (!cell(band, s).is_covered()) gaps.push_back(s);
  }
  return gaps;
}

std::vector<int> CoverageMap::unsharp(Band band) const {
  std::vector<int> unsharp;
  for (int s = 0; s < sectors; ++s) {
    if (!cell(band, s).is_covered() && cell(band, s).best_frame >= 0) unsharp.push_back(s);
  }
  return unsharp;
}

}  // namespace gyre
