// SPDX-License-Identifier: Apache-2.0
// What a person and an operator do wrong in a rendered walk, and when.
#pragma once

#include "tests/synthetic/capture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gyre::test {

// The person leans or steps aside; the operator steps nearer or away.
enum class Deed { lean, step, approach };

struct Act {
  Deed deed = Deed::lean;
  double begin = 0.0, rise = 0.8;  // seconds
  double hold = -1.0;              // seconds until it is undone as fast as it was done; negative: it stays
  double amount = 0.0;             // radians, metres (step), or share of the distance (approach)
  double direction = 0.0;          // of leaning and stepping, radians about the vertical

  double part(double time) const {
    const auto smooth = [](double t) {
      t = std::clamp(t, 0.0, 1.0);
      return t * t * (3 - 2 * t);
    };
    const double done = smooth((time - begin) / rise);
    return hold < 0.0 ? done : done * smooth((begin + 2 * rise + hold - time) / rise);
  }
  double end() const { return hold < 0.0 ? begin + rise : begin + 2 * rise + hold; }
};

inline bool is_of_person(Deed deed) {
  return deed != Deed::approach;
}

// The capture with those acts in it.
inline synthetic::Capture with_acts(synthetic::Capture capture, const std::vector<Act>& acts) {
  using Eigen::Vector3d;
  for (synthetic::FrameTruth& frame : capture.frames) {
    for (const Act& act : acts) {
      const double part = act.part(frame.time);
      const Vector3d way(std::sin(act.direction), 0.0, std::cos(act.direction));
      Pose move;
      if (act.deed == Deed::lean) move.rotation = Eigen::AngleAxisd(part * act.amount, Vector3d::UnitY().cross(way));
      if (act.deed == Deed::step) move.translation = part * act.amount * way;
      frame.world_from_subject = move * frame.world_from_subject;
      if (act.deed == Deed::approach) {
        // Along the sight: what the ratio leaves of the depth of the person's axis.
        const Vector3d centre = centre_of(frame.cam_from_world);
        const Vector3d sight = frame.cam_from_world.rotation.conjugate() * Vector3d::UnitZ();
        const double depth =
            Vector3d(-centre.x(), 0.0, -centre.z()).dot(sight) / Vector3d(sight.x(), 0.0, sight.z()).squaredNorm();
        frame.cam_from_world.translation.z() -= (1.0 - std::pow(act.amount, part)) * depth;
      }
    }
  }
  return capture;
}

// How far half of the subject's surface has moved across the sight within the last half second, metres.
inline double truly_moved(const synthetic::Capture& capture, int frame, double span = 0.5) {
  const int before = std::max(0, frame - static_cast<int>(std::lround(span * capture.options.fps)));
  std::vector<double> ways;
  constexpr std::size_t every = 20;
  for (std::size_t i = 0; i < capture.subject.mesh.vertices.size(); i += every) {
    const auto at = [&](int f) -> Eigen::Vector3d {
      const Eigen::Vector3d& v = capture.subject.mesh.vertices[i];
      return capture.frames[static_cast<std::size_t>(f)].world_from_subject * v;
    };
    const Eigen::Vector3d way = at(frame) - at(before);
    const Eigen::Vector3d sight =
        (at(frame) - centre_of(capture.frames[static_cast<std::size_t>(frame)].cam_from_world)).normalized();
    ways.push_back((way - way.dot(sight) * sight).norm());
  }
  const auto nth = ways.begin() + static_cast<std::ptrdiff_t>(0.5 * static_cast<double>(ways.size()));
  std::nth_element(ways.begin(), nth, ways.end());
  return *nth;
}

}  // namespace gyre::test
