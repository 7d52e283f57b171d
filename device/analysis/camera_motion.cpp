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

constexpr double memory = 1.0;         // of places that points have left, seconds
constexpr double moves = 1.8;          // motion of a subject that does not stand, pixels
constexpr double at_rest_after = 0.1;  // seconds

// Whether a point at that depth stands where the camera's way turns around.
bool stands_at(double depth, double radius) {
  constexpr double nearest = 0.4, farthest = 1.3;  // of the radius
  return depth > nearest * radius && depth < farthest * radius;
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

// Whether a point at that depth belongs to the subject, as far as depth tells.
bool CameraMotionEstimator::is_near(double depth) const {
  constexpr double near = 1.35;  // times the distance to the subject
  return depth <= near * subject_depth_;
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
//
// Most points may be the subject's, and when it moves they tell a pose that the room contradicts, or none. What the
// room tells then counts.
bool CameraMotionEstimator::resect(View& now) {
  std::vector<Sighting> all, room;
  std::vector<Vector3d> places;
  for (const auto& [id, at] : now.seen) {
    const auto point = points_.find(id);
    if (point == points_.end()) continue;
    all.push_back({static_cast<int>(places.size()), at});
    places.push_back(point->second);
    if (!is_near((now.cam_from_first * point->second).z())) room.push_back(all.back());
  }
  const auto agrees = [&](const Pose& pose, const std::vector<Sighting>& sightings) {
    const auto agree =
        static_cast<std::size_t>(std::count_if(sightings.begin(), sightings.end(), [&](const Sighting& s) {
          return reprojection_error(pose, places[static_cast<std::size_t>(s.point)], s.at) < limit();
        }));
    return agree >= options_.least_points && 2 * agree >= sightings.size();
  };
  const Pose by_all = resected(now.cam_from_first, all, places, adjustment());
  const bool all_agree = agrees(by_all, all);
  if (room.size() >= options_.least_points && !(all_agree && agrees(by_all, room))) {
    const Pose by_room = resected(now.cam_from_first, room, places, adjustment());
    if (agrees(by_room, room)) {
      now.cam_from_first = by_room;
      return true;
    }
  }
  if (all_agree) now.cam_from_first = by_all;
  return all_agree;
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

// A point that left its place gets a new one from what is seen from now on.
void CameraMotionEstimator::forget_sights(int id) {
  for (auto view = window_.begin(); view != std::prev(window_.end()); ++view) view->seen.erase(id);
}

void CameraMotionEstimator::forget_wrong_points() {
  const View& now = window_.back();
  for (auto point = points_.begin(); point != points_.end();) {
    const auto seen = now.seen.find(point->first);
    const bool is_gone = seen == now.seen.end();
    const bool is_wrong =
        !is_gone && reprojection_error(now.cam_from_first, point->second, seen->second) > 1.5 * limit();
    if (is_wrong) {
      left_.try_emplace(point->first, Left{now.time, point->second});
      forget_sights(point->first);
    }
    point = is_gone || is_wrong ? points_.erase(point) : std::next(point);
  }
}

// Who moves has no place, and what is seen of them meanwhile tells a wrong one: new places come from what is seen
// afterwards. Without a room to go by they stay.
void CameraMotionEstimator::leave_subject() {
  const View& now = window_.back();
  std::vector<int> subject;
  std::size_t room = 0;
  for (const auto& [id, at] : now.seen) {
    const auto point = points_.find(id);
    const bool is_room = point != points_.end() && !is_near((now.cam_from_first * point->second).z());
    if (is_room) ++room;
    if (!is_room && is_in_the_middle(at)) subject.push_back(id);
  }
  if (room < options_.least_points) return;
  for (const int id : subject) {
    if (const auto point = points_.find(id); point != points_.end()) {
      left_.try_emplace(id, Left{now.time, point->second});
      points_.erase(point);
    }
    forget_sights(id);
  }
}

// Of the view's points in the middle of the picture, with places.
std::vector<double> CameraMotionEstimator::depths_in_the_middle(const View& view) const {
  std::vector<double> depths;
  for (const auto& [id, at] : view.seen) {
    const auto point = points_.find(id);
    if (point == points_.end() || !is_in_the_middle(at)) continue;
    depths.push_back((view.cam_from_first * point->second).z());
  }
  return depths;
}

void CameraMotionEstimator::measure_distance(std::vector<double> depths) {
  if (depths.size() >= options_.least_points / 2) distance_ = quantile(std::move(depths), 0.4);
}

// The same points' depths before and now: whichever they are, they do not jump as others join them.
void CameraMotionEstimator::follow_distance(View& now) {
  std::vector<double> changes;
  for (const auto& [id, at] : now.seen) {
    const auto point = points_.find(id);
    if (point == points_.end() || !is_in_the_middle(at)) continue;
    const double before = (last_ * point->second).z();
    const double depth = (now.cam_from_first * point->second).z();
    if (before <= 0.0 || depth <= 0.0 || !is_near(depth)) continue;
    if (reprojection_error(now.cam_from_first, point->second, at) < 1.5 * limit())
      changes.push_back(std::log(depth / before));
  }
  if (changes.size() >= options_.least_points / 2) {
    const double change = median(std::move(changes));
    log_distance_ += change;
    subject_depth_ *= std::exp(change);
  }
  now.log_distance = log_distance_;
}

void CameraMotionEstimator::measure_subject_depth(std::vector<double> depths, const std::optional<double>& radius) {
  constexpr double most = 1.1;  // change at one view
  const double reach = radius.value_or(subject_depth_);
  std::erase_if(depths, [&](double depth) { return !stands_at(depth, reach); });
  if (depths.size() < options_.least_points / 2) {
    if (!subject_depth_known_) subject_depth_ = distance_;
    return;
  }
  const double depth = median(std::move(depths));
  subject_depth_ = subject_depth_known_ ? std::clamp(depth, subject_depth_ / most, subject_depth_ * most) : depth;
  subject_depth_known_ = subject_depth_known_ || radius;
}

// Since the last frame that is older than `span`, pixels.
SubjectShift CameraMotionEstimator::recent_shift(const View& now) {
  constexpr double span = 0.3;        // seconds
  constexpr double usual_way = 0.08;  // of the camera meanwhile, distances to the subject
  while (recent_.size() > 1 && recent_[1].time <= now.time - span) recent_.pop_front();
  std::erase_if(left_, [&](const auto& point) { return point.second.time < now.time - memory; });
  std::vector<PointShift> shifts;
  double way = 0.0;
  if (!recent_.empty() && now.time - recent_.front().time > 0.5 * span) {
    const View& then = recent_.front();
    const Pose now_from_then = now.cam_from_first * then.cam_from_first.inverse();
    way = now_from_then.translation.norm() / subject_depth_;
    for (const auto& [id, at] : now.seen) {
      const auto before = then.seen.find(id);
      if (before == then.seen.end()) continue;
      const auto left = left_.find(id);
      const auto point = points_.find(id);
      if (left == left_.end() && point == points_.end()) continue;
      const Vector3d& where = left != left_.end() ? left->second.place : point->second;
      const double depth = (then.cam_from_first * where).z();
      const Vector3d place = now_from_then * Vector3d(depth * before->second.homogeneous());
      if (depth <= 0.0 || place.z() <= 0.0) continue;
      const bool is_subject = is_near(place.z());
      if (is_subject && !is_in_the_middle(at)) continue;
      shifts.push_back({place, at - place.hnormalized(), is_subject});
    }
  }
  recent_.push_back(now);
  // What a wrong depth looks like grows with the camera's way.
  const double trust = camera_.fx * usual_way / std::max(usual_way, way);
  const SubjectShift shift = subject_shift(shifts, options_.noise / camera_.fx);
  return {trust * shift.half, trust * shift.part};
}

// Of the way around the subject; nothing while the camera does not turn, or goes nearer or away.
std::optional<double> CameraMotionEstimator::orbit_radius() const {
  constexpr double least_turn = 8.0 * M_PI / 180.0;
  constexpr double same = 0.1;  // logarithm of the distance
  const View& now = window_.back();
  const auto then = std::find_if(window_.rbegin(), window_.rend(), [&](const View& view) {
    return angle_between(view.cam_from_first.rotation, now.cam_from_first.rotation) >= least_turn;
  });
  if (then == window_.rend() || std::abs(now.log_distance - then->log_distance) > same) return std::nullopt;
  const double turn = angle_between(then->cam_from_first.rotation, now.cam_from_first.rotation);
  const double chord = (centre_of(now.cam_from_first) - centre_of(then->cam_from_first)).norm();
  return chord / (2.0 * std::sin(0.5 * turn));
}

std::optional<double> CameraMotionEstimator::subject_share(const std::vector<double>& depths,
                                                           const std::optional<double>& radius) const {
  if (!radius) return std::nullopt;
  // Points that have no place in spite of such a turn are far away.
  if (depths.size() < options_.least_points / 2) return 0.0;
  const auto there =
      std::count_if(depths.begin(), depths.end(), [&](double depth) { return stands_at(depth, *radius); });
  return static_cast<double>(there) / static_cast<double>(depths.size());
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
  now.time = time;
  now.log_distance = log_distance_;
  const double interval = std::max(time - last_time_, 1e-6);
  const double ratio = last_interval_ > 0.0 ? std::min(3.0, interval / last_interval_) : 1.0;
  now.cam_from_first = stretched(now_from_last_, ratio) * last_;
  const bool has_map = points_.size() >= options_.least_points;
  motion.known = has_map ? resect(now) : begin(now);
  const View& before = window_.back();
  const bool far = median_way(before, now) > options_.step * std::max(luma.cols, luma.rows);
  const bool few = static_cast<double>(now.seen.size()) < options_.survivors * static_cast<double>(before.seen.size());
  if (motion.known && has_map) {
    follow_distance(now);
    const SubjectShift shift = recent_shift(now);
    motion.subject_motion = shift.part;
    if (shift.half > moves) moved_at_ = time;
  }
  const auto is_moving_at = [&](double then) { return moved_at_ && then - *moved_at_ < at_rest_after; };
  const bool is_moving = is_moving_at(time);
  const bool came_to_rest = !is_moving && is_moving_at(last_time_);
  if (!motion.known) {
    // A new map starts here.
    window_.clear();
    points_.clear();
    left_.clear();
    recent_.clear();
    keep(now);
    subject_share_.reset();
    motion.is_view = true;
  } else if (far || few || came_to_rest) {
    keep(now);
    if (is_moving || came_to_rest) leave_subject();
    place_new_points();
    adjust();
    forget_wrong_points();
    now.cam_from_first = window_.back().cam_from_first;
    const std::vector<double> depths = depths_in_the_middle(window_.back());
    const std::optional<double> radius = orbit_radius();
    measure_distance(depths);
    if (!is_moving) measure_subject_depth(depths, radius);
    // The points of who moved just now have no places yet.
    const bool moved_just_now = moved_at_ && time - *moved_at_ <= memory;
    subject_share_ = moved_just_now ? std::nullopt : subject_share(depths, radius);
    motion.is_view = true;
  }
  now_from_last_ = now.cam_from_first * last_.inverse();
  last_ = now.cam_from_first;
  last_interval_ = interval;
  last_time_ = time;
  motion.cam_from_first = now.cam_from_first;
  motion.subject_distance = distance_;
  motion.log_distance = log_distance_;
  motion.subject_share = subject_share_;
  return motion;
}

}  // namespace gyre
