// SPDX-License-Identifier: Apache-2.0
// Whether the subject moves against the room, and what becomes of its points then.
#pragma once

#include "common/geometry/camera.h"
#include "device/analysis/subject_distance.h"
#include "device/analysis/subject_motion.h"
#include "device/analysis/view_map.h"

#include <deque>
#include <map>
#include <optional>
#include <vector>

namespace gyre {

// Remembers the frames of the last third of a second, and for a second places that points have left: who leans and
// stands again has moved meanwhile, also by points that the map gave up.
class SubjectWatch {
 public:
  // How far the subject's points moved against the room within the last third of a second, pixels of a camera at an
  // easy pace; of a faster one the same shift counts for less, as a wrong depth looks like one. Takes the frame, whose
  // pose is known; ascending times.
  SubjectShift add(const View& now, const ViewMap& map, const Camera& camera, const SubjectDistance& distance);

  bool is_moving(double time) const;
  // Its points have no places yet.
  bool moved_just_now(double time) const;

  // Who moves has no place, and what is seen of them meanwhile tells a wrong one: new places come from what is seen
  // afterwards. Without a room to go by they stay.
  void leave_subject(ViewMap& map, const Camera& camera, const SubjectDistance& distance);
  // Places that were left otherwise.
  void remember(const std::vector<PlacedPoint>& left, double time);

  // The map begins anew.
  void clear();

 private:
  struct Left {
    double time = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };

  std::deque<View> recent_;
  std::map<int, Left> left_;
  std::optional<double> moved_at_;  // seconds
};

}  // namespace gyre
