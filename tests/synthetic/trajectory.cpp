// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/trajectory.h"

#include "common/render/rasterise.h"
#include "tests/synthetic/noise.h"

#include <algorithm>
#include <cmath>

namespace gyre::synthetic {

namespace {

using Eigen::Vector3d;

constexpr double degree = M_PI / 180.0;
constexpr double stop_start = 0.13, rush_start = 0.32, span = 0.05;  // shares of the duration

double smooth(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// 1 inside [start, start + span], 0 outside, with short ramps: nobody starts or stops at once.
double during(double share, double start) {
  constexpr double ramp = 0.006;
  return smooth((share - start + ramp) / ramp) * smooth((start + span + ramp - share) / ramp);
}

struct Look {
  Vector3d eye, target;
};

Vector3d around(const Vector3d& centre, double azimuth, double elevation, double radius) {
  return centre + radius * Vector3d(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                                    std::cos(elevation) * std::cos(azimuth));
}

// Two rings, the first at the height of the face and the second at the height of the thighs, with a short way between;
// with an arc given, the second is walked backwards.
Look body_look(double u, double arc_deg) {
  const double down = smooth((u - 0.50) / 0.06);
  const double folded = u < 0.53 ? u / 0.53 : (1 - u) / 0.47;
  const double azimuth = (-8 + (arc_deg > 0 ? arc_deg * folded : 760 * u)) * degree;
  const double radius = 2.2 + 0.05 * std::sin(5 * azimuth / 3);
  return {around({0, 1.50 - 0.78 * down, 0}, azimuth, 0, radius), {0, 1.14 - 0.52 * down, 0}};
}

// A ring about the head, then over the crown and back, then below the chin.
Look head_look(double u) {
  const Vector3d centre(0, 1.575, 0.015);
  if (u < 0.62) return {around(centre, (-6 + 372 * u / 0.62) * degree, 0.03, 0.62), centre};
  const double v = (u - 0.62) / 0.38;
  const double elevation = v < 0.55 ? 72 * std::sin(M_PI * v / 0.55) : -46 * std::sin(M_PI * (v - 0.55) / 0.9);
  return {around(centre, (6 + 14 * std::sin(2 * M_PI * v)) * degree, 0.03 + elevation * degree, 0.62), centre};
}

Look turn_look() {
  return {{0, 1.15, 2.75}, {0, 0.92, 0}};
}

}  // namespace

Trajectory::Trajectory(const TrajectoryOptions& options) : options_(options) {
  constexpr int steps = 4000;
  travelled_.assign(1, 0.0);
  for (int i = 0; i < steps; ++i) travelled_.push_back(travelled_.back() + speed((i + 0.5) / steps * options.duration));
  for (double& d : travelled_) d /= std::max(travelled_.back(), 1e-12);
}

double Trajectory::speed(double time) const {
  const double share = time / options_.duration;
  double v = 1.0 + 0.12 * wander(time, 7);
  if (options_.stop) v *= 1.0 - during(share, stop_start);
  if (options_.rush) v *= 1.0 + 2.0 * during(share, rush_start);
  return v;
}

bool Trajectory::stopped(double time) const {
  return options_.stop && during(time / options_.duration, stop_start) > 0.5;
}
bool Trajectory::rushing(double time) const {
  return options_.rush && during(time / options_.duration, rush_start) > 0.5;
}

double Trajectory::progress(double time) const {
  const double at = std::clamp(time / options_.duration, 0.0, 1.0) * static_cast<double>(travelled_.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), travelled_.size() - 2);
  return travelled_[i] + (at - static_cast<double>(i)) * (travelled_[i + 1] - travelled_[i]);
}

double Trajectory::wander(double time, int channel) const {
  double sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    const std::uint64_t bits = hash(options_.seed, static_cast<std::uint64_t>(50 * channel + k));
    const double hertz = 0.15 * std::pow(2.1, k) * (0.8 + 0.4 * uniform(hash(bits)));
    sum += std::pow(0.6, k) * std::sin(2 * M_PI * (hertz * time + uniform(bits)));
  }
  return sum / 1.8;
}

Pose Trajectory::cam_from_world(double time) const {
  const double u = progress(time);
  Look look = options_.sequence == Sequence::orbit_body   ? body_look(u, options_.arc_deg)
              : options_.sequence == Sequence::orbit_head ? head_look(u)
                                                          : turn_look();
  if (options_.sequence == Sequence::turn) return look_at(look.eye, look.target);
  const double scale = options_.stature / 1.70;
  look.eye *= scale;
  look.target *= scale;
  const double hand = options_.jitter_mm * 1e-3;
  // Steps of the walk bob at 1.8 Hz; they end where the walk does.
  const double bob = 0.4 * hand * std::sin(2 * M_PI * 1.8 * time) * std::min(1.0, speed(time));
  look.eye += Vector3d(hand * wander(time, 1), hand * wander(time, 2) + bob, hand * wander(time, 3));
  const Pose steady = look_at(look.eye, look.target);
  const double tilt = options_.jitter_mm * 0.05 * degree;
  const Eigen::Quaterniond shake = Eigen::AngleAxisd(tilt * wander(time, 4), Vector3d::UnitX()) *
                                   Eigen::AngleAxisd(tilt * wander(time, 5), Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(2 * tilt * wander(time, 6), Vector3d::UnitZ());
  return Pose{shake, Vector3d::Zero()} * steady;
}

double Trajectory::yaw(double time) const {
  return options_.sequence == Sequence::turn ? progress(time) * 372 * degree : 0.0;
}

// The two leans are coordinates on a disc, so that together they never exceed the given angle.
double Trajectory::sway_roll(double time) const {
  return options_.sway_deg * degree / std::sqrt(2.0) * std::clamp(wander(time, 8), -1.0, 1.0);
}
double Trajectory::sway_pitch(double time) const {
  return options_.sway_deg * degree / std::sqrt(2.0) * std::clamp(wander(time, 9), -1.0, 1.0);
}

Pose Trajectory::world_from_subject(double time) const {
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(Eigen::AngleAxisd(sway_roll(time), Vector3d::UnitZ())) *
                                      Eigen::AngleAxisd(sway_pitch(time), Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(yaw(time), Vector3d::UnitY());
  return {rotation, Vector3d::Zero()};
}

std::string Trajectory::segment(double time) const {
  const double u = progress(time);
  switch (options_.sequence) {
    case Sequence::orbit_body:
      return u < 0.50 ? "ring1" : u < 0.56 ? "transition" : "ring2";
    case Sequence::orbit_head:
      return u < 0.62 ? "ring" : (u - 0.62) / 0.38 < 0.55 ? "crown" : "chin";
    case Sequence::turn:
      return "turn";
  }
  return "turn";
}

}  // namespace gyre::synthetic
