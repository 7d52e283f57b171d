// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_watch.h"

#include <algorithm>

namespace gyre {

namespace {

constexpr double memory = 1.0;  // seconds

}  // namespace

SubjectShift SubjectWatch::add(const View& now, const ViewMap& map, const Camera& camera,
                               const SubjectDistance& distance) {
  constexpr double span = 0.3;        // seconds
  constexpr double usual_way = 0.08;  // of the camera meanwhile, distances to the subject
  constexpr double moves = 1.8;       // a subject that does not stand, pixels
  while (recent_.size() > 1 && recent_[1].time <= now.time - span) recent_.pop_front();
  std::erase_if(left_, [&](const auto& point) { return point.second.time < now.time - memory; });
  std::vector<PointShift> shifts;
  double way = 0.0;
  if (!recent_.empty() && now.time - recent_.front().time > 0.5 * span) {
    const View& then = recent_.front();
    const Pose now_from_then = now.cam_from_first * then.cam_from_first.inverse();
    way = now_from_then.translation.norm() / distance.depth();
    for (const auto& [id, at] : now.seen) {
      const auto before = then.seen.find(id);
      if (before == then.seen.end()) continue;
      const auto left = left_.find(id);
      const auto point = map.points().find(id);
      if (left == left_.end() && point == map.points().end()) continue;
      const Eigen::Vector3d& where = left != left_.end() ? left->second.place : point->second;
      const double depth = (then.cam_from_first * where).z();
      const Eigen::Vector3d place = now_from_then * Eigen::Vector3d(depth * before->second.homogeneous());
      if (depth <= 0.0 || place.z() <= 0.0) continue;
      const bool is_subject = distance.is_near(place.z());
      if (is_subject && !is_in_the_middle(camera, at)) continue;
      shifts.push_back({place, at - place.hnormalized(), is_subject});
    }
  }
  recent_.push_back(now);
  // What a wrong depth looks like grows with the camera's way.
  const double trust = camera.fx * usual_way / std::max(usual_way, way);
  const SubjectShift shift = subject_shift(shifts, map.noise());
  if (trust * shift.half > moves) moved_at_ = now.time;
  return {trust * shift.half, trust * shift.part};
}

bool SubjectWatch::is_moving(double time) const {
  constexpr double at_rest_after = 0.1;  // seconds
  return moved_at_ && time - *moved_at_ < at_rest_after;
}

bool SubjectWatch::moved_just_now(double time) const {
  return moved_at_ && time - *moved_at_ <= memory;
}

void SubjectWatch::leave_subject(ViewMap& map, const Camera& camera, const SubjectDistance& distance) {
  constexpr std::size_t least_room = 12;  // points
  const View& now = map.views().back();
  std::vector<int> subject;
  std::size_t room = 0;
  for (const auto& [id, at] : now.seen) {
    const auto point = map.points().find(id);
    const bool is_room = point != map.points().end() && !distance.is_near((now.cam_from_first * point->second).z());
    if (is_room) ++room;
    if (!is_room && is_in_the_middle(camera, at)) subject.push_back(id);
  }
  if (room >= least_room) remember(map.leave_places(subject), now.time);
}

void SubjectWatch::remember(const std::vector<PlacedPoint>& left, double time) {
  for (const PlacedPoint& point : left) left_.try_emplace(point.id, Left{time, point.place});
}

void SubjectWatch::clear() {
  recent_.clear();
  left_.clear();
}

}  // namespace gyre
