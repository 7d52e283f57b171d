// SPDX-License-Identifier: Apache-2.0
// A template small enough to know every number of: a box with two joints and one expression.
#pragma once

#include "offload/body/template.h"

namespace gyre {

// A box 0.4 m wide and deep, 1 m high, of eight vertices. Every side is a chart of its own, so every corner has three
// texture coordinates. Joint "hips" carries the lower vertices, its child "head" the upper ones. Expression "jawOpen"
// lowers the two upper front vertices by 1 cm.
inline BodyTemplate small_template() {
  BodyTemplate body;
  body.name = "box";
  body.checksum = "none";
  for (int i = 0; i < 8; ++i) {
    body.mesh.vertices.emplace_back(i & 1 ? 0.2 : -0.2, i & 2 ? 1.0 : 0.0, i & 4 ? 0.2 : -0.2);
    body.regions.push_back(i & 2 ? BodyRegion::head : BodyRegion::torso);
    SkinWeights s;
    s.joint = {i & 2 ? 1 : 0, 0, 0, 0};
    s.weight = {1, 0, 0, 0};
    body.skin.push_back(s);
  }
  const int sides[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7}, {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
  for (int s = 0; s < 6; ++s) {
    const Eigen::Vector2d corner(s % 3 / 3.0, s / 3 / 2.0);
    const int first = static_cast<int>(body.mesh.uv.size());
    for (const auto& [u, v] : {std::pair(0.0, 1.0), std::pair(1.0, 1.0), std::pair(1.0, 0.0), std::pair(0.0, 0.0)}) {
      body.mesh.uv.emplace_back(corner + Eigen::Vector2d((0.05 + 0.9 * u) / 3.0, (0.05 + 0.9 * v) / 2.0));
    }
    for (const auto& [a, b, c] : {std::tuple(0, 1, 2), std::tuple(0, 2, 3)}) {
      body.mesh.triangles.emplace_back(sides[s][a], sides[s][b], sides[s][c]);
      body.mesh.uv_triangles.emplace_back(first + a, first + b, first + c);
    }
  }
  body.parts.push_back({"body", 0, 8, 0, 12});
  body.joints = {{"hips", -1, {{0, 0.5}, {5, 0.5}}}, {"head", 0, {{2, 0.5}, {7, 0.5}}}};
  body.mirror = {1, 0, 3, 2, 5, 4, 7, 6};
  body.expressions = {{"jawOpen", {6, 7}, {{0, -0.01F, 0}, {0, -0.01F, 0}}}};
  return body;
}

}  // namespace gyre
