// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/jaw.h"

#include "offload/landmarks/curve.h"

#include <cmath>
#include <numbers>

namespace gyre {

namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double half_strip = 0.004;  // metres beside a section that count as on it
constexpr double behind = 0.100;      // metres from the tip of the nose to the middle of the head
constexpr double bend_reach = 0.012;  // metres to either side of the edge
constexpr double beside_deviation = 0.010, out_deviation = 0.002;  // metres

struct Section {
  const char* name;
  double azimuth;            // radians from straight ahead
  double down;               // radians from horizontal: the middle between the normals above and below the edge
  Eigen::Vector2d expected;  // outward and up from the middle of the head, metres at a stature of 1.7 m
  double bend;               // metres by which the section falls back at least
  double along_deviation;    // metres: the angle is blunt
};

}  // namespace

std::vector<JawMark> find_jaw(const FaceFrame& frame, const std::array<std::vector<Eigen::Vector3d>, 2>& sides,
                              double stature) {
  const double s = std::clamp(stature / 1.7, 0.7, 1.1);
  const Eigen::Isometry3d face_from_world = frame.world_from_face.inverse();
  const Eigen::Vector3d middle(0, 0, -behind * s);
  std::vector<JawMark> marks;
  for (const Section& section : {Section{"Jaw", 24 * degree, 45 * degree, {0.066, -0.063}, 0.0018, 0.004},
                                 Section{"JawAngle", 62 * degree, 30 * degree, {0.062, -0.036}, 0.0012, 0.010}})
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector2d out(std::cos(section.down), -std::sin(section.down)), along(-out.y(), out.x());
      const Eigen::Vector3d outward(side * std::sin(section.azimuth), 0, std::cos(section.azimuth));
      const Eigen::Vector3d beside = outward.cross(Eigen::Vector3d::UnitY());
      std::vector<Eigen::Vector2d> sample;
      for (const Eigen::Vector3d& point : sides[side > 0 ? 0 : 1]) {
        const Eigen::Vector3d d = face_from_world * point - middle;
        const Eigen::Vector2d q(d.dot(outward), d.y());
        if (std::abs(d.dot(beside)) > half_strip || q.x() < 0.03 * s || q.x() > 0.12 * s) continue;
        sample.emplace_back(q.dot(along), q.dot(out));
      }
      const double from = section.expected.dot(along) * s + 0.03, to = section.expected.dot(along) * s - 0.03;
      const Curve curve = smooth_curve(sample, to - 0.02, from + 0.02, 0.006);
      const auto t = first_extremum(curve, 1, from, to, 0.008);
      if (!t || !(curve.at(*t) - std::max(curve.at(*t - bend_reach), curve.at(*t + bend_reach)) > section.bend))
        continue;
      const Eigen::Vector2d q = *t * along + curve.at(*t) * out;
      Eigen::Matrix3d axes;
      axes.col(0) = beside;
      axes.col(1) = along.x() * outward + along.y() * Eigen::Vector3d::UnitY();
      axes.col(2) = out.x() * outward + out.y() * Eigen::Vector3d::UnitY();
      const Eigen::Vector3d deviations(beside_deviation, section.along_deviation, out_deviation);
      marks.push_back({(side > 0 ? "left" : "right") + std::string(section.name),
                       middle + q.x() * outward + q.y() * Eigen::Vector3d::UnitY(),
                       axes * deviations.cwiseAbs2().asDiagonal() * axes.transpose()});
    }
  return marks;
}

}  // namespace gyre
