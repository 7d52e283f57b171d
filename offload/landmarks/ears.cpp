// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/ears.h"

#include "offload/landmarks/relief.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// Axes of a side's relief in the face's frame: x backwards on the left and forwards on the right, y up, z outwards.
Eigen::Isometry3d face_from_side(double side) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear().col(0) = Eigen::Vector3d(0, 0, -side);
  frame.linear().col(1) = Eigen::Vector3d::UnitY();
  frame.linear().col(2) = Eigen::Vector3d(side, 0, 0);
  return frame;
}

// How far the surface falls back behind a place of the relief, from what is known there.
double step_behind(const Relief& relief, const Eigen::Vector2d& at, double backwards, double s) {
  double least = relief.at(at);
  const double here = least;
  for (double d = 0.006; d <= 0.020; d += relief.cell) {
    const double there = relief.at(at + Eigen::Vector2d(backwards * d * s, 0));
    if (std::isfinite(there)) least = std::min(least, there);
  }
  return here - least;
}

std::optional<EarMarks> find_ear(const FaceFrame& frame, const std::vector<Eigen::Vector3d>& points, double side,
                                 double s) {
  const Eigen::Isometry3d face_from_relief = face_from_side(side);
  ReliefOptions options;
  options.depth = 0.006;
  const double forwards = 0.07 * s, backwards = 0.17 * s;  // metres behind the tip of the nose
  options.low = {side > 0 ? forwards : -backwards, -0.06 * s};
  options.high = {side > 0 ? backwards : -forwards, 0.09 * s};
  const Relief relief = make_relief(points, frame.world_from_face * face_from_relief, options);

  // The rim's farthest point.
  constexpr double step = 0.007;  // metres
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();
  double farthest = 0.05 * s;
  for (int row = 0; row < relief.rows; ++row)
    for (int column = 0; column < relief.columns; ++column) {
      const Eigen::Vector2d at = relief.centre(column, row);
      const double height = relief.height[relief.index(column, row)];
      if (!(height > farthest) || at.y() < -0.01 * s || at.y() > 0.065 * s || height > 0.11 * s) continue;
      if (step_behind(relief, at, side, s) < step) continue;
      farthest = height;
      tip = at;
    }
  if (tip.isZero()) return std::nullopt;

  // The lowest place that hangs together with it and stands out nearly as far.
  constexpr double auricle = 0.8;  // share of the tip's distance from the midline where the ear begins
  std::vector<bool> seen(relief.height.size(), false);
  std::vector<Eigen::Vector2i> open{((tip - relief.low) / relief.cell).array().floor().cast<int>()};
  Eigen::Vector2i lowest = open.front();
  while (!open.empty()) {
    const Eigen::Vector2i at = open.back();
    open.pop_back();
    if (at.y() < lowest.y()) lowest = at;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2i next = at + Eigen::Vector2i((k == 0) - (k == 1), (k == 2) - (k == 3));
      if (!relief.inside(next.x(), next.y()) || seen[relief.index(next.x(), next.y())]) continue;
      seen[relief.index(next.x(), next.y())] = true;
      const bool stands_out = relief.height[relief.index(next.x(), next.y())] > auricle * farthest;
      if (stands_out && (relief.centre(next.x(), next.y()) - tip).norm() < 0.06 * s) open.push_back(next);
    }
  }
  const auto place = [&](const Eigen::Vector2d& at) -> Eigen::Vector3d {
    return face_from_relief * Eigen::Vector3d(at.x(), at.y(), relief.at(at));
  };
  EarMarks marks{place(tip), place(relief.centre(lowest.x(), lowest.y()))};
  const bool hangs = marks.tip.y() - marks.lobe.y() > 0.02 * s && marks.lobe.y() > -0.05 * s;
  return hangs && marks.tip.allFinite() && marks.lobe.allFinite() ? std::optional(marks) : std::nullopt;
}

}  // namespace

std::optional<std::array<EarMarks, 2>> find_ears(const FaceFrame& frame,
                                                 const std::array<std::vector<Eigen::Vector3d>, 2>& sides,
                                                 double stature) {
  const double s = std::clamp(stature / 1.7, 0.7, 1.1);
  const auto left = find_ear(frame, sides[0], 1.0, s), right = find_ear(frame, sides[1], -1.0, s);
  if (!left || !right) return std::nullopt;
  constexpr double alike = 0.012;  // metres
  const Eigen::Vector3d mirror(-1, 1, 1);
  for (const auto part : {&EarMarks::tip, &EarMarks::lobe})
    if (((*left).*part - mirror.cwiseProduct((*right).*part)).norm() > alike) return std::nullopt;
  return std::array{*left, *right};
}

}  // namespace gyre
