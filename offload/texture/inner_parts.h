// SPDX-License-Identifier: Apache-2.0
// Generated colours for the parts of the template that no photograph shows well: eyes, teeth, tongue, mouth. Lashes are
// cards of the template that painted dark would be a bar; they take the photographs' colours.
#pragma once

#include "offload/body/template.h"
#include "offload/texture/eye_colours.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

class InnerPaint {
 public:
  explicit InnerPaint(const BodyTemplate& body);

  // Moves the neutral colours in CIELAB: iris and white onto those of the person, mouth and teeth by half of what the
  // white moved, which is the light's doing.
  void match(const EyeColours& person);

  // One a triangle of the template: 1 where the colour is generated.
  const std::vector<std::uint8_t>& covered() const { return covered_; }

  // Encoded BGR at a point of a covered triangle given by its corner weights.
  Eigen::Vector3f colour(int triangle, const Eigen::Vector3d& weights) const;

 private:
  enum class Kind : std::uint8_t { none, eye, teeth, tongue, mouth, socket };
  struct Eye {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 0.0;
  };

  // The skin's own inside: mouth, and eye sockets behind the lids.
  void cover_cavities();
  Eigen::Vector3f eye_colour(const Eye& eye, const Eigen::Vector3d& point) const;
  Eigen::Vector3f neutral_colour(int triangle) const;

  const BodyTemplate& body_;
  std::vector<std::uint8_t> covered_;
  std::vector<Kind> kind_;
  std::vector<std::uint8_t> eye_of_;
  std::vector<Eye> eyes_;
  Eigen::Vector3f iris_shift_ = Eigen::Vector3f::Zero(), white_shift_ = Eigen::Vector3f::Zero();  // CIELAB
};

}  // namespace gyre
