// SPDX-License-Identifier: Apache-2.0
#include "device/host_notices.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// Only bands that the pass has seen anything of.
wire::CoveragePreview coverage_of(const LiveStatus& status) {
  wire::CoveragePreview preview;
  preview.scan = status.scan;
  preview.pass = status.pass;
  for (const Band band : all_bands) {
    const auto& cells = status.cells[static_cast<std::size_t>(band)];
    if (std::none_of(cells.begin(), cells.end(), [](const CellStatus& cell) { return cell.is_seen; })) continue;
    wire::CoverageBand& out = preview.bands.emplace_back();
    out.name = name_of(band);
    const auto covered =
        std::count_if(cells.begin(), cells.end(), [](const CellStatus& cell) { return cell.is_covered; });
    out.share = static_cast<double>(covered) / static_cast<double>(cells.size());
    for (const CellStatus& cell : cells) {
      constexpr double best = 255.0;
      const double level = cell.is_seen ? std::max(1.0, best * std::clamp(cell.quality, 0.0, 1.0)) : 0.0;
      out.cells.push_back(static_cast<char>(static_cast<unsigned char>(std::lround(level))));
    }
  }
  return preview;
}

bool same_cells(const wire::CoveragePreview& a, const wire::CoveragePreview& b) {
  return a.scan == b.scan && a.pass == b.pass &&
         std::equal(a.bands.begin(), a.bands.end(), b.bands.begin(), b.bands.end(),
                    [](const auto& x, const auto& y) { return x.name == y.name && x.cells == y.cells; });
}

}  // namespace

void HostNotices::show(const LiveStatus& status) {
  const std::string state(name_of(status.state));
  const std::string sentence(status.signal.sentence);
  std::string now = state + '\n' + sentence + '\n' + status.scan;
  if (now != told_) {
    told_ = std::move(now);
    uplink_.tell(state, sentence, status.scan);
  }
  if (status.scan.empty() || status.state != SessionState::pass) return;
  wire::CoveragePreview preview = coverage_of(status);
  if (preview.bands.empty() || same_cells(preview, seen_)) return;
  seen_ = preview;
  uplink_.tell(std::move(preview));
}

}  // namespace gyre
