// SPDX-License-Identifier: Apache-2.0
// A head identity space for a template, from a face model with another mesh.
#pragma once

#include "offload/body/face_model.h"
#include "offload/body/template.h"

#include <vector>

namespace gyre {

struct HeadSpace {
  // First "headMean", which takes the template's mean head to the model's mean face; then one "head..." for each mode.
  // Offsets of one standard deviation, fading out at the neck.
  std::vector<Morph> components;
  std::array<int, 68> points{};  // the template's vertices at the model's landmarks
  double distance = 0;           // root mean square distance of the matched vertices to the model's mean face, metres
  double matched = 0;            // share of the face's vertices that lie on it
};

// Brings the template's head onto the model's mean face: rigidly by landmarks, then by non-rigid closest points with a
// falling stiffness (Amberg, Romdhani, Vetter, "Optimal Step Nonrigid ICP Algorithms for Surface Registration", 2007,
// with a thin plate energy for its affine one), and hands the modes over at the points found. What has no counterpart
// (lining of the mouth, sockets, neck) follows smoothly, parts inside the head by similarities of what surrounds them.
// body needs everything but its head components. Error when it lacks landmarks or the surfaces do not come together.
Result<HeadSpace> transfer_head_space(const BodyTemplate& body, const FaceModel& face);

}  // namespace gyre
