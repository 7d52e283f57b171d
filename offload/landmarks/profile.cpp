// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/profile.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace gyre {

namespace {

constexpr double half_strip = 0.004;  // metres beside the midline that count as on it
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// A profile: distance out of the face over a coordinate, at equal steps; NaN where it is not known.
struct Curve {
  double low = 0, step = 0.001;
  std::vector<double> out;

  int index(double t) const { return static_cast<int>(std::lround((t - low) / step)); }
  double at(double t) const {
    const int i = index(t);
    return i < 0 || i >= static_cast<int>(out.size()) ? nan : out[i];
  }
};

// Local quadratic regression of the foremost points (Cleveland, "Robust locally weighted regression", JASA 1979, with
// one robust pass); `sample` holds (t, out).
Curve smooth_curve(const std::vector<Eigen::Vector2d>& sample, double low, double high, double width) {
  Curve curve;
  curve.low = low;
  for (double t = low; t <= high; t += curve.step) {
    double foremost = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& s : sample)
      if (std::abs(s.x() - t) < width) foremost = std::max(foremost, s.y());
    std::optional<Eigen::Vector3d> fit;
    for (int pass = 0; pass < 2; ++pass) {
      Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      double total = 0, before = 0, after = 0;
      for (const Eigen::Vector2d& s : sample) {
        const double d = (s.x() - t) / width;
        if (std::abs(d) >= 1 || s.y() < foremost - 0.02) continue;
        const Eigen::Vector3d row(1, d, d * d);
        double weight = std::pow(1 - std::abs(d * d * d), 3);
        if (fit) weight /= 1 + std::pow((s.y() - row.dot(*fit)) / 0.0015, 2);
        a += weight * row * row.transpose();
        b += weight * s.y() * row;
        total += weight;
        (d < 0 ? before : after) += weight;
      }
      if (total < 4 || std::min(before, after) < 0.15 * total) {
        fit.reset();
        break;
      }
      a.diagonal() += Eigen::Vector3d(0, 1e-3, 1e-2) * total;
      fit = a.ldlt().solve(b);
    }
    curve.out.push_back(fit ? (*fit)[0] : nan);
  }
  return curve;
}

// Walking from `from` to `to`, the first place where the curve times `sign` is larger than everywhere within `window`
// on both sides, refined by a parabola over that window, or 6 mm if that is less. Nothing when there is none before an
// unknown stretch as long as the window.
std::optional<double> first_extremum(const Curve& curve, double sign, double from, double to, double window) {
  const int count = static_cast<int>(curve.out.size()), reach = static_cast<int>(std::lround(window / curve.step));
  const int first = curve.index(from), last = curve.index(to), way = first < last ? 1 : -1;
  int unknown = 0;
  for (int i = first; i != last + way; i += way) {
    if (i < 1 || i + 1 >= count || std::isnan(curve.out[i])) {
      if (++unknown > reach) return std::nullopt;
      continue;
    }
    unknown = 0;
    bool largest = true;
    int before = 0, after = 0;  // lower neighbours on either side
    for (int k = -reach; k <= reach; ++k) {
      if (k == 0 || i + k < 0 || i + k >= count || std::isnan(curve.out[i + k])) continue;
      largest = largest && sign * curve.out[i + k] <= sign * curve.out[i];
      (k < 0 ? before : after) += sign * curve.out[i + k] < sign * curve.out[i] ? 1 : 0;
    }
    if (!largest || before < reach / 2 || after < reach / 2) continue;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    const int near = std::min(reach, static_cast<int>(std::lround(0.006 / curve.step)));
    for (int k = std::max(-near, -i); k <= std::min(near, count - 1 - i); ++k) {
      if (std::isnan(curve.out[i + k])) continue;
      const double d = k * curve.step / window;
      const Eigen::Vector3d row(1, d, d * d);
      a += row * row.transpose();
      b += sign * curve.out[i + k] * row;
    }
    const double t = curve.low + i * curve.step;
    const Eigen::Vector3d fit = a.ldlt().solve(b);
    if (fit[2] >= -1e-9) return t;
    return t + window * std::clamp(-0.5 * fit[1] / fit[2], -0.5, 0.5);
  }
  return std::nullopt;
}

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
  const auto t = first_extremum(turned, 1, -0.045 * s, -0.100 * s, 0.008);
  if (t && !std::isnan(turned.at(*t))) {
    const Eigen::Vector2d q = *t * along + turned.at(*t) * out;
    profile.marks["chin"] = {{0, q.x(), q.y()}, 0.003, 0.0015};
  } else {
    profile.missing["chin"] = "the cloud does not show where the chin turns under";
  }
  return profile;
}

}  // namespace gyre
