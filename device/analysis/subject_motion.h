// SPDX-License-Identifier: Apache-2.0
// How far the subject moved against the room within a moment, whatever the camera did.
#pragma once

#include <Eigen/Core>
#include <span>

namespace gyre {

// A point that was seen at both ends of the moment.
struct PointShift {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // in the camera's axes at the end
  // Normalised image: by how much more the point moved than one that stands there, as far as the camera is known.
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  bool is_subject = false;  // else of the room
};

// How far points of the subject shifted at the least, normalised image units.
struct SubjectShift {
  double half = 0.0;  // half of them: the subject as a whole
  double part = 0.0;  // three tenths of them: also a turned head, and not a handful of strays
};

// Without what a further motion of the camera explains. That motion is told by the room; where the room leaves it open,
// as a step to the side does before a far wall, the subject is taken to stand. Zero without enough points of the
// subject. noise: of a point, normalised.
SubjectShift subject_shift(std::span<const PointShift> points, double noise);

}  // namespace gyre
