// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/view_map.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

namespace gyre {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t most_views = 8;
constexpr double noise_px = 0.5;       // of a point
constexpr double least_angle = 0.017;  // between two sights of a point that is given a place, radians

// Where two sights of a point come closest, when they meet at `least_angle` or more before both cameras.
std::optional<Vector3d> meeting(const Pose& a, const Vector2d& in_a, const Pose& b, const Vector2d& in_b) {
  const Vector3d from = centre_of(a);
  const Vector3d base = centre_of(b) - from;
  const Vector3d u = (a.rotation.conjugate() * in_a.homogeneous()).normalized();
  const Vector3d v = (b.rotation.conjugate() * in_b.homogeneous()).normalized();
  if (u.cross(v).norm() < std::sin(least_angle)) return std::nullopt;
  Eigen::Matrix<double, 3, 2> rays;
  rays << u, -v;
  const Vector2d way = (rays.transpose() * rays).ldlt().solve(rays.transpose() * base);
  if (way.x() <= 0 || way.y() <= 0) return std::nullopt;
  return from + way.x() * u;
}

}  // namespace

double ViewMap::limit() const {
  return 4.0 * noise();
}

double ViewMap::noise() const {
  return noise_px / focal_;
}

AdjustmentOptions ViewMap::adjustment() const {
  return {.least_scale = 0.2 * noise(), .largest_scale = 2.0 * noise()};
}

void ViewMap::clear() {
  views_.clear();
  points_.clear();
}

void ViewMap::add(View view) {
  views_.push_back(std::move(view));
  if (views_.size() > most_views) views_.pop_front();
}

void ViewMap::place_new_points() {
  const View& now = views_.back();
  for (const auto& [id, at] : now.seen) {
    if (points_.contains(id)) continue;
    for (const View& view : views_) {
      const auto before = view.seen.find(id);
      if (&view == &now || before == view.seen.end()) continue;
      const std::optional<Vector3d> place = meeting(view.cam_from_first, before->second, now.cam_from_first, at);
      if (place) points_[id] = *place;
      break;  // the oldest view has the widest angle
    }
  }
}

void ViewMap::adjust() {
  std::vector<int> ids;
  std::vector<Vector3d> places;
  std::map<int, int> index;
  std::vector<WindowView> views;
  for (const View& view : views_) {
    WindowView& out = views.emplace_back();
    out.cam_from_world = view.cam_from_first;
    for (const auto& [id, at] : view.seen) {
      const auto point = points_.find(id);
      if (point == points_.end()) continue;
      const auto [entry, is_new] = index.emplace(id, static_cast<int>(places.size()));
      if (is_new) {
        places.push_back(point->second);
        ids.push_back(id);
      }
      out.sightings.push_back({entry->second, at});
    }
  }
  // Two views that stay carry the scale on.
  const std::size_t fixed = views.size() > 2 ? 2 : 1;
  adjust_window(views, fixed, places, adjustment());
  for (std::size_t i = 0; i < views.size(); ++i) views_[i].cam_from_first = views[i].cam_from_world;
  for (std::size_t i = 0; i < ids.size(); ++i) points_[ids[i]] = places[i];
}

std::vector<PlacedPoint> ViewMap::leave_wrong_places() {
  const View& now = views_.back();
  std::erase_if(points_, [&](const auto& point) { return !now.seen.contains(point.first); });
  std::vector<int> wrong;
  for (const auto& [id, place] : points_) {
    if (reprojection_error(now.cam_from_first, place, now.seen.at(id)) > 1.5 * limit()) wrong.push_back(id);
  }
  return leave_places(wrong);
}

std::vector<PlacedPoint> ViewMap::leave_places(const std::vector<int>& ids) {
  std::vector<PlacedPoint> left;
  for (const int id : ids) {
    if (const auto point = points_.find(id); point != points_.end()) {
      left.push_back({id, point->second});
      points_.erase(point);
    }
    for (auto view = views_.begin(); view != std::prev(views_.end()); ++view) view->seen.erase(id);
  }
  return left;
}

}  // namespace gyre
