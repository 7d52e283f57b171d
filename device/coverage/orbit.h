// SPDX-License-Identifier: Apache-2.0
// Where the camera is on its way around the subject, from its motion between frames and nothing else.
#pragma once

#include "common/geometry/pose.h"
#include "device/analysis/camera_motion.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace gyre {

// All from where the pass began.
struct OrbitPlace {
  double azimuth = 0.0;    // of the camera around the subject, radians, counter-clockwise seen from above, not wrapped
  double height = 0.0;     // of the camera, units of its distance to the subject
  double elevation = 0.0;  // angle by which the camera looks further down, radians: how it stands above the subject
  bool known = true;       // false while the picture does not tell and the walk is assumed to go on as before
};

// The camera is taken to look at the subject all the time, so its heading is its azimuth. The vertical is where the
// picture's lies in the first frame, later the axis that the camera's turns have in common (its tilt is at most 25
// degrees). Keeps one pose; belongs to one thread.
class Orbit {
 public:
  // The motion of the next frame.
  OrbitPlace add(const CameraMotion& motion);

  // What correct() needs to know later of the frame added last.
  struct Mark {
    double azimuth = 0.0;
    Eigen::Quaterniond first_from_then = Eigen::Quaterniond::Identity();
  };
  Mark mark() const { return {scale_ * raw_ + offset_, first_from_now_}; }

  // The turn from a marked frame to the last one is known otherwise, as that view is seen again. The azimuth that is
  // missing since, radians; and taking it out, as well as as large a part of it from every turn to come.
  double drift(const Mark& then, const Eigen::Quaterniond& now_from_then) const;
  void correct(const Mark& then, const Eigen::Quaterniond& now_from_then);

 private:
  double heading(const Eigen::Quaterniond& first_from_now) const;
  void learn_vertical(const Eigen::Quaterniond& turn);
  OrbitPlace place() const;

  Eigen::Quaterniond first_from_now_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond first_from_view_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d last_centre_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d travelled_ = Eigen::Vector3d::Zero();  // first camera's axes, distances to the subject
  Eigen::Vector3d up_ = -Eigen::Vector3d::UnitY();
  // Axes of all turns, each weighing its angle; at first half a radian about the picture's vertical.
  Eigen::Matrix3d turns_ = 0.5 * Eigen::Vector3d::UnitY() * Eigen::Vector3d::UnitY().transpose();
  double raw_ = 0.0;  // heading, not wrapped, as measured
  double scale_ = 1.0, offset_ = 0.0;
  bool known_ = true;
};

}  // namespace gyre
