// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/view_collector.h"

#include <algorithm>
#include <limits>

namespace gyre {

namespace {

// Of the picture's longer side.
constexpr double still = 0.004;  // from one picture to the next
constexpr double other = 0.015;  // to every view that was taken

// Mean distance of the corners that both have, pixels; infinite when they share too few.
double distance(const BoardView& a, const BoardView& b) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const BoardCorner& one : a) {
    const auto same = std::ranges::find(b, one.corner, &BoardCorner::corner);
    if (same == b.end()) continue;
    sum += (one.pixel - same->pixel).norm();
    ++count;
  }
  return count >= least_corners ? sum / static_cast<double>(count) : std::numeric_limits<double>::infinity();
}

}  // namespace

bool ViewCollector::add(const BoardView& view) {
  const double side = std::max(width_, height_);
  moved_ = distance(view, last_) > still * side;
  last_ = view;
  if (view.size() < least_corners || moved_) return false;
  if (std::ranges::any_of(views_, [&](const BoardView& v) { return distance(view, v) < other * side; })) return false;
  views_.push_back(view);
  return true;
}

bool ViewCollector::is_enough() const {
  return static_cast<int>(views_.size()) >= wanted_views && covered(views_, width_, height_) >= wanted_cover;
}

double ViewCollector::fraction() const {
  const double views = std::min(1.0, static_cast<double>(views_.size()) / wanted_views);
  const double cover = std::min(1.0, covered(views_, width_, height_) / wanted_cover);
  return std::min(views, cover);
}

std::string ViewCollector::advice() const {
  if (last_.size() < least_corners) return "show the whole board";
  if (moved_) return "hold still";
  if (covered(views_, width_, height_) >= wanted_cover) return "tilt the board to another side";
  return "now with the board in the picture's " + not_covered(views_, width_, height_).front();
}

}  // namespace gyre
