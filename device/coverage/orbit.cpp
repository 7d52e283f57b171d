// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/orbit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double degree = M_PI / 180.0;

Vector3d turn_vector(const Quaterniond& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() > M_PI ? Vector3d((turn.angle() - 2 * M_PI) * turn.axis()) : Vector3d(turn.angle() * turn.axis());
}

double wrapped(double angle) {
  return std::remainder(angle, 2 * M_PI);
}

}  // namespace

// The part of the rotation that is about the vertical.
double Orbit::heading(const Quaterniond& first_from_now) const {
  return 2.0 * std::atan2(first_from_now.vec().dot(up_), first_from_now.w());
}

void Orbit::learn_vertical(const Quaterniond& turn) {
  constexpr double most_tilt = 25 * degree;
  constexpr double upright = 0.85;  // cosine; other turns nod or roll
  const Vector3d vector = turn_vector(turn);
  if (std::abs(vector.dot(up_)) < upright * vector.norm()) return;
  turns_ += vector * vector.transpose() / std::max(vector.norm(), 1e-9);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(turns_);
  Vector3d axis = solver.eigenvectors().col(2);
  if (axis.y() > 0) axis = -axis;
  if (-axis.y() >= std::cos(most_tilt)) up_ = axis;
}

OrbitPlace Orbit::place() const {
  OrbitPlace place;
  place.azimuth = scale_ * raw_ + offset_;
  place.height = up_.dot(travelled_);
  const double begun = std::asin(std::clamp(up_.z(), -1.0, 1.0));
  const double now = std::asin(std::clamp(up_.dot(first_from_now_ * Vector3d::UnitZ()), -1.0, 1.0));
  place.elevation = begun - now;
  place.known = known_;
  return place;
}

OrbitPlace Orbit::add(const CameraMotion& motion) {
  known_ = motion.known;
  first_from_now_ = motion.cam_from_first.rotation.conjugate();
  const Vector3d centre = centre_of(motion.cam_from_first);
  travelled_ += (centre - last_centre_) / motion.subject_distance;
  last_centre_ = centre;
  if (motion.is_view) {
    if (known_) learn_vertical(first_from_now_ * first_from_view_.conjugate());
    first_from_view_ = first_from_now_;
  }
  raw_ += wrapped(heading(first_from_now_) - raw_);
  return place();
}

double Orbit::drift(const Mark& then, const Quaterniond& now_from_then) const {
  const double turned = heading(then.first_from_then * now_from_then.conjugate()) - heading(then.first_from_then);
  return wrapped(then.azimuth + turned - (scale_ * raw_ + offset_));
}

void Orbit::correct(const Mark& then, const Quaterniond& now_from_then) {
  constexpr double most = 0.08;  // of all turns, that a wrong focal length may explain
  const double missing = drift(then, now_from_then);
  const double azimuth = scale_ * raw_ + offset_;
  const double way = azimuth - then.azimuth;
  if (std::abs(way) > M_PI) scale_ = std::clamp(scale_ * (1.0 + missing / way), 1.0 - most, 1.0 + most);
  offset_ = azimuth + missing - scale_ * raw_;
}

}  // namespace gyre
