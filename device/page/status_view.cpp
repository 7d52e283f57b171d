// SPDX-License-Identifier: Apache-2.0
#include "device/page/status_view.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace gyre {

namespace {

using nlohmann::json;

constexpr double degrees = 180.0 / M_PI;

json band_view(Band band, const std::array<CellStatus, CoverageMap::sectors>& cells) {
  std::string seen;
  std::string quality;
  for (const CellStatus& cell : cells) {
    seen += cell.is_covered ? '#' : cell.is_seen ? '~' : '.';
    quality += static_cast<char>('0' + std::clamp(static_cast<int>(10.0 * cell.quality), 0, 9));
  }
  const bool is_ring = band != Band::crown && band != Band::chin;
  return {{"band", name_of(band)}, {"is_ring", is_ring}, {"cells", seen}, {"quality", quality}};
}

// A turn on somebody's own feet: nothing tells what has been seen of them.
bool is_without_places(const LiveStatus& status) {
  const auto& cells = status.cells[static_cast<std::size_t>(bands_of(status.pass).front())];
  return status.pass == "turn" && !status.azimuth &&
         std::none_of(cells.begin(), cells.end(), [](const CellStatus& cell) { return cell.is_seen; });
}

std::string_view name_of(Colour colour) {
  constexpr std::array<std::string_view, 6> names = {"off", "white", "green", "blue", "yellow", "red"};
  return names[static_cast<std::size_t>(colour)];
}

std::string_view name_of(Pattern pattern) {
  constexpr std::array<std::string_view, 4> names = {"steady", "slow_blink", "fast_blink", "pulse"};
  return names[static_cast<std::size_t>(pattern)];
}

json signal_view(const Signal& signal) {
  return {{"colour", name_of(signal.colour)}, {"pattern", name_of(signal.pattern)}, {"sentence", signal.sentence}};
}

}  // namespace

json status_view(const LiveStatus& status) {
  json conditions = json::array();
  for (std::size_t i = 0; i < condition_count; ++i) {
    if (!status.conditions[i]) continue;
    const auto condition = static_cast<Condition>(i);
    json view = signal_view(signal_of(condition, status.pass == "turn"));
    view["name"] = name_of(condition);
    conditions.push_back(std::move(view));
  }
  json coverage = json::array();
  for (const Band band : bands_of(status.pass)) {
    if (is_without_places(status)) break;
    coverage.push_back(band_view(band, status.cells[static_cast<std::size_t>(band)]));
  }
  return {{"state", name_of(status.state)},
          {"scan", status.scan},
          {"pass", status.pass},
          {"fault", status.fault},
          {"notice", status.notice},
          {"signal", signal_view(status.signal)},
          {"conditions", std::move(conditions)},
          {"azimuth_deg", status.azimuth ? json(*status.azimuth * degrees) : json()},
          {"sector", status.azimuth ? json(CoverageMap::sector_of(*status.azimuth)) : json()},
          {"band", name_of(status.band)},
          {"coverage", std::move(coverage)},
          {"frames", status.frames},
          {"keyframes", status.keyframes},
          {"acknowledged", status.acknowledged},
          {"frames_per_second", std::round(10.0 * status.frames_per_second) / 10.0},
          {"disk_free_mib", std::round(status.disk_free_mib)},
          {"host",
           {{"is_wanted", status.host.is_wanted},
            {"is_connected", status.host.is_connected},
            {"text", status.host.text},
            {"stage", status.host.stage},
            {"fraction", status.host.fraction}}}};
}

}  // namespace gyre
