// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/camera_motion.h"

#include "common/geometry/quantile.h"
#include "device/analysis/relative_pose.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

namespace gyre {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The motion between two frames, for an interval `ratio` times as long.
Pose stretched(const Pose& pose, double ratio) {
  const Eigen::AngleAxisd turn(pose.rotation);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(ratio * turn.angle(), turn.axis())), ratio * pose.translation};
}

constexpr std::size_t least_points = 12;

}  // namespace

View CameraMotionEstimator::sight() const {
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
  const View& first = map_.views().back();
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
    if (is_in_the_middle(camera_, camera_.normalised_from_pixel(from[i]))) middle.push_back(pose->depth[i]);
  }
  const double distance = quantile(middle.size() >= least_points / 2 ? middle : all, 0.4);
  if (!(distance > 0.0)) return false;
  const Pose scaled{pose->b_from_a.rotation, pose->b_from_a.translation * distance_.nearest() / distance};
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
    const auto point = map_.points().find(id);
    if (point == map_.points().end()) continue;
    all.push_back({static_cast<int>(places.size()), at});
    places.push_back(point->second);
    if (!distance_.is_near((now.cam_from_first * point->second).z())) room.push_back(all.back());
  }
  const auto agrees = [&](const Pose& pose, const std::vector<Sighting>& sightings) {
    const auto agree =
        static_cast<std::size_t>(std::count_if(sightings.begin(), sightings.end(), [&](const Sighting& s) {
          return reprojection_error(pose, places[static_cast<std::size_t>(s.point)], s.at) < map_.limit();
        }));
    return agree >= least_points && 2 * agree >= sightings.size();
  };
  const Pose by_all = resected(now.cam_from_first, all, places, map_.adjustment());
  const bool all_agree = agrees(by_all, all);
  if (room.size() >= least_points && !(all_agree && agrees(by_all, room))) {
    const Pose by_room = resected(now.cam_from_first, room, places, map_.adjustment());
    if (agrees(by_room, room)) {
      now.cam_from_first = by_room;
      return true;
    }
  }
  if (all_agree) now.cam_from_first = by_all;
  return all_agree;
}

// Of the newest view's points in the middle of the picture, with places.
std::vector<double> CameraMotionEstimator::depths_in_the_middle() const {
  const View& view = map_.views().back();
  std::vector<double> depths;
  for (const auto& [id, at] : view.seen) {
    const auto point = map_.points().find(id);
    if (point == map_.points().end() || !is_in_the_middle(camera_, at)) continue;
    depths.push_back((view.cam_from_first * point->second).z());
  }
  return depths;
}

// Of the way around the subject; nothing while the camera does not turn, or goes nearer or away.
std::optional<double> CameraMotionEstimator::orbit_radius() const {
  constexpr double least_turn = 8.0 * M_PI / 180.0;
  constexpr double same = 0.1;  // logarithm of the distance
  const std::deque<View>& views = map_.views();
  const View& now = views.back();
  const auto then = std::find_if(views.rbegin(), views.rend(), [&](const View& view) {
    return angle_between(view.cam_from_first.rotation, now.cam_from_first.rotation) >= least_turn;
  });
  if (then == views.rend() || std::abs(now.log_distance - then->log_distance) > same) return std::nullopt;
  const double turn = angle_between(then->cam_from_first.rotation, now.cam_from_first.rotation);
  const double chord = (centre_of(now.cam_from_first) - centre_of(then->cam_from_first)).norm();
  return chord / (2.0 * std::sin(0.5 * turn));
}

// The view joins the map; new points begin in it.
void CameraMotionEstimator::keep(View now) {
  tracks_.refill();
  now.seen = sight().seen;
  map_.add(std::move(now));
}

CameraMotion CameraMotionEstimator::add(const cv::Mat& luma, double time) {
  constexpr double step = 0.05;      // median way of the points that makes a new view, share of the longer side
  constexpr double survivors = 0.7;  // of a view's points, below which there is a new one
  tracks_.add(luma);
  CameraMotion motion;
  if (map_.views().empty()) {
    camera_ = camera_.scaled(static_cast<double>(luma.cols) / camera_.width);
    map_ = ViewMap(camera_);
    keep({});
    motion.is_view = true;
    last_time_ = time;
    return motion;
  }

  View now = sight();
  now.time = time;
  now.log_distance = distance_.log_distance();
  const double interval = std::max(time - last_time_, 1e-6);
  const double ratio = last_interval_ > 0.0 ? std::min(3.0, interval / last_interval_) : 1.0;
  now.cam_from_first = stretched(now_from_last_, ratio) * last_;
  const bool has_map = map_.points().size() >= least_points;
  motion.known = has_map ? resect(now) : begin(now);
  const View& before = map_.views().back();
  const bool far = median_way(before, now) > step * std::max(luma.cols, luma.rows);
  const bool few = static_cast<double>(now.seen.size()) < survivors * static_cast<double>(before.seen.size());
  if (motion.known && has_map) {
    distance_.follow(map_, camera_, last_, now);
    now.log_distance = distance_.log_distance();
    motion.subject_motion = watch_.add(now, map_, camera_, distance_).part;
  }
  const bool is_moving = watch_.is_moving(time);
  const bool came_to_rest = !is_moving && watch_.is_moving(last_time_);
  if (!motion.known) {
    // A new map starts here.
    map_.clear();
    watch_.clear();
    keep(now);
    subject_share_.reset();
    motion.is_view = true;
  } else if (far || few || came_to_rest) {
    keep(now);
    if (is_moving || came_to_rest) watch_.leave_subject(map_, camera_, distance_);
    map_.place_new_points();
    map_.adjust();
    watch_.remember(map_.leave_wrong_places(), time);
    now.cam_from_first = map_.views().back().cam_from_first;
    const std::vector<double> depths = depths_in_the_middle();
    const std::optional<double> radius = orbit_radius();
    distance_.measure_nearest(depths);
    if (!is_moving) distance_.measure_depth(depths, radius);
    subject_share_ = watch_.moved_just_now(time) ? std::nullopt : subject_share(depths, radius);
    motion.is_view = true;
  }
  now_from_last_ = now.cam_from_first * last_.inverse();
  last_ = now.cam_from_first;
  last_interval_ = interval;
  last_time_ = time;
  motion.cam_from_first = now.cam_from_first;
  motion.subject_distance = distance_.nearest();
  motion.log_distance = distance_.log_distance();
  motion.subject_share = subject_share_;
  return motion;
}

}  // namespace gyre
