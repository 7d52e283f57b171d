// SPDX-License-Identifier: Apache-2.0
// Generated skin for the hands, whose fingers are too thin and too lively for photographs to fit them.
#pragma once

#include "offload/body/template.h"
#include "offload/texture/atlas.h"
#include "offload/texture/paint.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace gyre {

// A neutral skin with palms, knuckles and nails, on the template at rest. Hands of a template without finger joints
// stay as photographed.
class HandPaint {
 public:
  explicit HandPaint(const BodyTemplate& body);

  // One a triangle of the template: 1 where the colour is generated.
  const std::vector<std::uint8_t>& covered() const { return covered_; }

  // Moves backs and palms in CIELAB onto the medians of what photographs that look straight at them show; without
  // enough of that onto the forearms', else onto the face's. canvas: the photographs, blended, in the layout of the
  // template. Returns what it was matched to: "hands", "forearms", "face", or "" for nothing.
  std::string match(const Atlas& atlas, const Canvas& canvas);

  // Encoded BGR at a point of a covered triangle given by its corner weights.
  Eigen::Vector3f colour(int triangle, const Eigen::Vector3d& weights) const;

 private:
  struct Finger {
    std::vector<Eigen::Vector3d> knuckles;  // metres, rest pose, from the hand outwards
    Eigen::Vector3d along, back;            // unit: to the tip; out of the nail
    double length = 0.0;                    // from the last knuckle to the tip, metres
  };
  // What a place of the skin is, each 0 to 1.
  struct Place {
    float palm = 0.0F, nail = 0.0F, knuckle = 0.0F;
  };

  void add_hand(const std::string& side, const std::vector<Eigen::Vector3d>& joints);
  Finger finger(const std::vector<int>& chain, const std::vector<Eigen::Vector3d>& joints,
                const Eigen::Vector3d& back) const;
  int strongest_joint(int vertex) const;
  Place place_at(int triangle, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

  const BodyTemplate& body_;
  std::vector<Eigen::Vector3d> normals_;  // one a vertex, rest pose
  std::vector<std::uint8_t> covered_;
  std::vector<Finger> fingers_;
  std::vector<int> finger_of_;             // one a triangle, -1: none
  std::array<Eigen::Vector3d, 2> palms_;   // out of the left and the right palm
  std::array<Eigen::Vector3f, 2> shifts_;  // of backs and palms, CIELAB
};

}  // namespace gyre
