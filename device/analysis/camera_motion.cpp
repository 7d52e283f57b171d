// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/camera_motion.h"

#include "common/geometry/quantile.h"
#include "device/analysis/relative_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The motion between two frames, for an interval `ratio` times as long.
Pose stretched(const Pose& pose, double ratio) {
  const Eigen::AngleAxisd turn(pose.rotation);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(ratio * turn.angle(), turn.axis())), ratio * pose.translation};
}

// Where two sights of a point come closest, when they meet at `least_angle` or more before both cameras.
std::optional<Vector3d> meeting(const Pose& a, const Vector2d& in_a, const Pose& b, const Vector2d& in_b,
                                double least_angle) {
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

double CameraMotionEstimator::limit() const {
  return 4.0 * options_.noise / camera_.fx;
}

AdjustmentOptions CameraMotionEstimator::adjustment() const {
  return {.least_scale = 0.2 * options_.noise / camera_.fx, .largest_scale = 2.0 * options_.noise / camera_.fx};
}

// Whether it lies in the upright ellipse in the middle of the picture that a framed subject fills.
bool CameraMotionEstimator::is_in_the_middle(const Vector2d& at) const {
  const Vector2d pixel = camera_.pixel_from_normalised(at);
  constexpr double half_width = 0.3;  // of the shorter side
  constexpr double half_height = 0.42;
  const double x = (pixel.x() - 0.5 * camera_.width) / (half_width * std::min(camera_.width, camera_.height));
  const double y = (pixel.y() - 0.5 * camera_.height) / (half_height * camera_.height);
  return x * x + y * y <= 1.0;
}

CameraMotionEstimator::View CameraMotionEstimator::sight() const {
  View view;
  for (std::size_t i = 0; i < tracks_.ids().size(); ++i) {
    const cv::Point2f& at = tracks_.positions()[i];
    view.seen[tracks_.ids()[i]] = camera_.normalised_from_pixel({at.x + 0.5, at.y + 0.5});
  }
  return view;
}

double CameraMotionEstimator::median_way(const View& from, const View& to) const {
  std::vector<double> ways;
  for (const auto& [id, at] : to.seen) {
    const auto before = from.seen.find(id);
    if (before != from.seen.end()) ways.push_back((at - before->second).norm());
  }
  return camera_.fx * quantile(std::move(ways), 0.5);
}

// Without a map: the motion since the only view there is. True when that tells how the camera moved.
bool CameraMotionEstimator::begin(View& now) {
  const View& first = window_.back();
  std::vector<Vector2d> from, to;
  for (const auto& [id, at] : now.seen) {
    const auto before = first.seen.find(id);
    if (before == first.seen.end()) continue;
    from.push_back(camera_.pixel_from_normalised(before->second));
    to.push_back(camera_.pixel_from_normalised(at));
  }
  const std::optional<RelativePose> pose = relative_pose(from, to, camera_);
  if (!pose) return false;
  now.cam_from_first = pose->b_from_a * first.cam_from_first;
  if (!pose->has_parallax()) return true;

  std::vector<double> middle, all;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (pose->depth[i] <= 0.0) continue;
    all.push_back(pose->depth[i]);
    if (is_in_the_middle(camera_.normalised_from_pixel(from[i]))) middle.push_back(pose->depth[i]);
  }
  const double distance = quantile(middle.size() >= options_.least_points / 2 ? middle : all, 0.4);
  if (!(distance > 0.0)) return false;
  const Pose scaled{pose->b_from_a.rotation, pose->b_from_a.translation * distance_ / distance};
  now.cam_from_first = scaled * first.cam_from_first;
  return true;
}

// With a map: the pose that its points tell. now.cam_from_first: where it may be.
bool CameraMotionEstimator::resect(View& now) {
  std::vector<Sighting> sightings;
  std::vector<Vector3d> places;
  for (const auto& [id, at] : now.seen) {
    const auto point = points_.find(id);
    if (point == points_.end()) continue;
    sightings.push_back({static_cast<int>(places.size()), at});
    places.push_back(point->second);
  }
  if (places.size() < options_.least_points) return false;
  const Pose pose = resected(now.cam_from_first, sightings, places, adjustment());
  const auto agree = static_cast<std::size_t>(std::count_if(sightings.begin(), sightings.end(), [&](const Sighting& s) {
    return reprojection_error(pose, places[static_cast<std::size_t>(s.point)], s.at) < limit();
  }));
  if (agree < options_.least_points || 2 * agree < sightings.size()) return false;
  now.cam_from_first = pose;
  return true;
}

void CameraMotionEstimator::place_new_points() {
  const View& now = window_.back();
  for (const auto& [id, at] : now.seen) {
    if (points_.contains(id)) continue;
    for (const View& view : window_) {
      const auto before = view.seen.find(id);
      if (&view == &now || before == view.seen.end()) continue;
      const std::optional<Vector3d> place =
          meeting(view.cam_from_first, before->second, now.cam_from_first, at, options_.least_angle);
      if (place) points_[id] = *place;
      break;  // the oldest view has the widest angle
    }
  }
}

void CameraMotionEstimator::adjust() {
  std::vector<int> ids;
  std::vector<Vector3d> places;
  std::map<int, int> index;
  std::vector<WindowView> views;
  for (const View& view : window_) {
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
  for (std::size_t i = 0; i < views.size(); ++i) window_[i].cam_from_first = views[i].cam_from_world;
  for (std::size_t i = 0; i < ids.size(); ++i) points_[ids[i]] = places[i];
}

void CameraMotionEstimator::forget_wrong_points() {
  const View& now = window_.back();
  for (auto point = points_.begin(); point != points_.end();) {
    const auto seen = now.seen.find(point->first);
    const bool is_gone = seen == now.seen.end();
    const bool is_wrong =
        !is_gone && reprojection_error(now.cam_from_first, point->second, seen->second) > 1.5 * limit();
    point = is_gone || is_wrong ? points_.erase(point) : std::next(point);
  }
}

void CameraMotionEstimator::measure_distance(const View& view) {
  std::vector<double> depths;
  for (const auto& [id, at] : view.seen) {
    const auto point = points_.find(id);
    if (point == points_.end() || !is_in_the_middle(at)) continue;
    depths.push_back((view.cam_from_first * point->second).z());
  }
  if (depths.size() >= options_.least_points / 2) distance_ = quantile(std::move(depths), 0.4);
}

double CameraMotionEstimator::subject_motion(const View& view) const {
  constexpr double near = 1.35;  // times the distance to the subject
  std::vector<double> errors;
  for (const auto& [id, at] : view.seen) {
    const auto point = points_.find(id);
    if (point == points_.end() || !is_in_the_middle(at)) continue;
    if ((view.cam_from_first * point->second).z() > near * distance_) continue;
    errors.push_back(camera_.fx * reprojection_error(view.cam_from_first, point->second, at));
  }
  return errors.size() >= options_.least_points / 2 ? quantile(std::move(errors), 0.75) : 0.0;
}

std::optional<double> CameraMotionEstimator::subject_share() const {
  constexpr double least_turn = 8.0 * M_PI / 180.0;  // below which the radius is not known
  constexpr double nearest = 0.4, farthest = 1.3;    // of the radius
  const View& now = window_.back();
  const auto then = std::find_if(window_.rbegin(), window_.rend(), [&](const View& view) {
    return angle_between(view.cam_from_first.rotation, now.cam_from_first.rotation) >= least_turn;
  });
  if (then == window_.rend()) return std::nullopt;
  const double turn = angle_between(then->cam_from_first.rotation, now.cam_from_first.rotation);
  const double chord = (centre_of(now.cam_from_first) - centre_of(then->cam_from_first)).norm();
  const double radius = chord / (2.0 * std::sin(0.5 * turn));
  std::size_t there = 0, all = 0;
  for (const auto& [id, at] : now.seen) {
    const auto point = points_.find(id);
    if (point == points_.end() || !is_in_the_middle(at)) continue;
    const double depth = (now.cam_from_first * point->second).z();
    if (depth > nearest * radius && depth < farthest * radius) ++there;
    ++all;
  }
  // Points that have no place in spite of such a turn are far away.
  return all < options_.least_points / 2 ? 0.0 : static_cast<double>(there) / static_cast<double>(all);
}

// The view joins the window; new points begin in it.
void CameraMotionEstimator::keep(View now) {
  tracks_.refill();
  now.seen = sight().seen;
  window_.push_back(std::move(now));
  if (window_.size() > options_.window) window_.pop_front();
}

CameraMotion CameraMotionEstimator::add(const cv::Mat& luma, double time) {
  tracks_.add(luma);
  CameraMotion motion;
  if (window_.empty()) {
    camera_ = camera_.scaled(static_cast<double>(luma.cols) / camera_.width);
    keep({});
    motion.is_view = true;
    last_time_ = time;
    return motion;
  }

  View now = sight();
  const double interval = std::max(time - last_time_, 1e-6);
  const double ratio = last_interval_ > 0.0 ? std::min(3.0, interval / last_interval_) : 1.0;
  now.cam_from_first = stretched(now_from_last_, ratio) * last_;
  const bool has_map = points_.size() >= options_.least_points;
  motion.known = has_map ? resect(now) : begin(now);
  const View& before = window_.back();
  const bool far = median_way(before, now) > options_.step * std::max(luma.cols, luma.rows);
  const bool few = static_cast<double>(now.seen.size()) < options_.survivors * static_cast<double>(before.seen.size());
  if (motion.known) motion.subject_motion = subject_motion(now);
  if (!motion.known) {
    // A new map starts here.
    window_.clear();
    points_.clear();
    keep(now);
    subject_share_.reset();
    motion.is_view = true;
  } else if (far || few) {
    keep(now);
    place_new_points();
    adjust();
    forget_wrong_points();
    now.cam_from_first = window_.back().cam_from_first;
    measure_distance(window_.back());
    subject_share_ = subject_share();
    motion.is_view = true;
  }
  now_from_last_ = now.cam_from_first * last_.inverse();
  last_ = now.cam_from_first;
  last_interval_ = interval;
  last_time_ = time;
  motion.cam_from_first = now.cam_from_first;
  motion.subject_distance = distance_;
  motion.subject_share = subject_share_;
  return motion;
}

}  // namespace gyre
