// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/profile.h"

#include "offload/landmarks/curve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace gyre {

namespace {

constexpr double half_strip = 0.004;  // metres beside the midline that count as on it
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Points near the midline as (t, out) where t and out are measured along two axes of the face's plane x = 0.
std::vector<Eigen::Vector2d> strip(const std::vector<Eigen::Vector3d>& face, const Eigen::Vector2d& along,
                                   const Eigen::Vector2d& out) {
  std::vector<Eigen::Vector2d> sample;
  for (const Eigen::Vector3d& p : face) {
    if (std::abs(p.x()) > half_strip) continue;
    const Eigen::Vector2d q(p.y(), p.z());
    sample.emplace_back(q.dot(along), q.dot(out));
  }
  return sample;
}

}  // namespace

FaceProfile read_profile(const FaceFrame& frame, const std::vector<Eigen::Vector3d>& points, double stature) {
  FaceProfile profile;
  const double s = std::clamp(stature / 1.7, 0.7, 1.1);
  const Eigen::Isometry3d face_from_world = frame.world_from_face.inverse();
  std::vector<Eigen::Vector3d> face;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = face_from_world * point;
    if (std::abs(p.x()) < half_strip && p.y() > -0.13 && p.y() < 0.1 && p.z() > -0.1) face.push_back(p);
  }
  const Curve curve = smooth_curve(strip(face, {1, 0}, {0, 1}), -0.12, 0.09, 0.005);
  const auto mark = [&](const char* name, double sign, double from, double to, double window, double along,
                        const char* reason) -> double {
    const auto y = first_extremum(curve, sign, from, to, window);
    if (!y || std::isnan(curve.at(*y))) {
      profile.missing[name] = reason;
      return nan;
    }
    profile.marks[name] = {{0, *y, curve.at(*y)}, along, 0.0015};
    return *y;
  };
  const double tip = mark("noseTip", 1, 0.012 * s, -0.014 * s, 0.010, 0.002, "the cloud has no tip of the nose");
  const double at = std::isnan(tip) ? 0.0 : tip;
  mark("sellion", -1, at + 0.022 * s, at + 0.062 * s, 0.012, 0.003, "no dip between brow and nose is to be seen");
  const double base = mark("noseBase", -1, at - 0.005 * s, at - 0.026 * s, 0.004, 0.002,
                           "the cloud does not show the base of the nose");
  // The lips: out, in, out below the nose.
  const double below_nose = std::isnan(base) ? at - 0.014 * s : base;
  const double upper = mark("upperLip", 1, below_nose - 0.003, below_nose - 0.025 * s, 0.003, 0.0025,
                            "the cloud does not show the upper lip");
  const double above_line = std::isnan(upper) ? below_nose - 0.010 * s : upper;
  const auto line = first_extremum(curve, -1, above_line - 0.002, above_line - 0.018 * s, 0.003);
  if (line) profile.mouth = *line;
  const double split = line ? *line : below_nose - 0.017 * s;
  mark("lowerLip", 1, split - 0.001, split - 0.020 * s, 0.003, 0.0025, "the cloud does not show the lower lip");

  // The chin in axes turned by 45 degrees: out = forward and down, along = forward and up.
  const Eigen::Vector2d out = Eigen::Vector2d(-1, 1).normalized(), along = Eigen::Vector2d(1, 1).normalized();
  std::vector<Eigen::Vector3d> lower;
  for (const Eigen::Vector3d& p : face)
    if (p.y() < at - 0.030 * s && p.y() > at - 0.110 * s && p.z() > -0.080) lower.push_back(p);
  const Curve turned = smooth_curve(strip(lower, along, out), -0.14, 0.0, 0.006);
  std::optional<double> t;  // full lips bend too, but less far out
  for (double from = -0.045 * s; from > -0.100 * s;) {
    const auto next = first_extremum(turned, 1, from, -0.100 * s, 0.008);
    if (!next) break;
    if (!t || turned.at(*next) > turned.at(*t)) t = next;
    from = *next - 0.008;
  }
  if (t && !std::isnan(turned.at(*t))) {
    const Eigen::Vector2d q = *t * along + turned.at(*t) * out;
    profile.marks["chin"] = {{0, q.x(), q.y()}, 0.003, 0.0015};
  } else {
    profile.missing["chin"] = "the cloud does not show where the chin turns under";
  }
  return profile;
}

}  // namespace gyre
