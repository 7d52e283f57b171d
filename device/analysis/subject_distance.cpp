// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_distance.h"

#include "common/geometry/quantile.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gyre {

namespace {

constexpr std::size_t least_depths = 6;

// Whether a point at that depth stands where the camera's way turns around.
bool stands_at(double depth, double radius) {
  constexpr double nearest = 0.4, farthest = 1.3;  // of the radius
  return depth > nearest * radius && depth < farthest * radius;
}

}  // namespace

bool is_in_the_middle(const Camera& camera, const Eigen::Vector2d& at) {
  const Eigen::Vector2d pixel = camera.pixel_from_normalised(at);
  constexpr double half_width = 0.3;  // of the shorter side
  constexpr double half_height = 0.42;
  const double x = (pixel.x() - 0.5 * camera.width) / (half_width * std::min(camera.width, camera.height));
  const double y = (pixel.y() - 0.5 * camera.height) / (half_height * camera.height);
  return x * x + y * y <= 1.0;
}

bool SubjectDistance::is_near(double depth) const {
  constexpr double near = 1.35;  // times the distance to the subject
  return depth <= near * depth_;
}

// The same points' depths before and now: whichever they are, they do not jump as others join them.
void SubjectDistance::follow(const ViewMap& map, const Camera& camera, const Pose& before, const View& now) {
  std::vector<double> changes;
  for (const auto& [id, at] : now.seen) {
    const auto point = map.points().find(id);
    if (point == map.points().end() || !is_in_the_middle(camera, at)) continue;
    const double depth_before = (before * point->second).z();
    const double depth = (now.cam_from_first * point->second).z();
    if (depth_before <= 0.0 || depth <= 0.0 || !is_near(depth)) continue;
    if (reprojection_error(now.cam_from_first, point->second, at) < 1.5 * map.limit()) {
      changes.push_back(std::log(depth / depth_before));
    }
  }
  if (changes.size() < least_depths) return;
  const double change = median(std::move(changes));
  log_distance_ += change;
  depth_ *= std::exp(change);
}

void SubjectDistance::measure_nearest(std::vector<double> depths) {
  if (depths.size() >= least_depths) nearest_ = quantile(std::move(depths), 0.4);
}

void SubjectDistance::measure_depth(std::vector<double> depths, const std::optional<double>& radius) {
  constexpr double most = 1.1;  // change at one view
  const double reach = radius.value_or(depth_);
  std::erase_if(depths, [&](double depth) { return !stands_at(depth, reach); });
  if (depths.size() < least_depths) {
    if (!depth_known_) depth_ = nearest_;
    return;
  }
  const double depth = median(std::move(depths));
  depth_ = depth_known_ ? std::clamp(depth, depth_ / most, depth_ * most) : depth;
  depth_known_ = depth_known_ || radius;
}

std::optional<double> subject_share(const std::vector<double>& depths, const std::optional<double>& radius) {
  if (!radius) return std::nullopt;
  // Points that have no place in spite of such a turn are far away.
  if (depths.size() < least_depths) return 0.0;
  const auto there =
      std::count_if(depths.begin(), depths.end(), [&](double depth) { return stands_at(depth, *radius); });
  return static_cast<double>(there) / static_cast<double>(depths.size());
}

}  // namespace gyre
