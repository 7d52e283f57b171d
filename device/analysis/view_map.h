// SPDX-License-Identifier: Apache-2.0
// A few recent views and the places of the points they saw, adjusted together.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "device/analysis/window_adjustment.h"

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <map>
#include <vector>

namespace gyre {

// What a camera saw from one place. Points are normalised image points by their number.
struct View {
  Pose cam_from_first;
  std::map<int, Eigen::Vector2d> seen;
  double time = 0.0;          // seconds
  double log_distance = 0.0;  // see CameraMotion
};

struct PlacedPoint {
  int id = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // first camera's axes
};

// A map without a past: of the newest views of a camera, which carry scale and axes on from each to the next.
class ViewMap {
 public:
  // camera: of the pictures that points are followed in.
  explicit ViewMap(const Camera& camera) : focal_(camera.fx) {}

  const std::deque<View>& views() const { return views_; }
  const std::map<int, Eigen::Vector3d>& points() const { return points_; }  // first camera's axes
  void clear();

  // The oldest of too many views goes.
  void add(View view);
  // What has no place and was seen by the newest view and, under a wide enough angle, by an older one.
  void place_new_points();
  // Poses and places to the least error in all views.
  void adjust();
  // Places that the newest view does not see are dropped, and those it sees elsewhere are left.
  std::vector<PlacedPoint> leave_wrong_places();
  // The point gets a new place from what is seen from the newest view on. Returns the one it had, if any.
  std::vector<PlacedPoint> leave_places(const std::vector<int>& ids);

  // Of a point that is where the map has it: how far from there it may be seen at most, normalised.
  double limit() const;
  AdjustmentOptions adjustment() const;
  double noise() const;  // of a point, normalised

 private:
  double focal_;
  std::deque<View> views_;
  std::map<int, Eigen::Vector3d> points_;
};

}  // namespace gyre
