// SPDX-License-Identifier: Apache-2.0
// The survey's measures taken on the base mesh.
#pragma once

#include "offload/body/ansur.h"
#include "offload/body/body_measures.h"
#include "offload/body/makehuman.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Tapes and landmarks that stay on the same points of the surface whatever its shape.
class BaseMeasures {
 public:
  explicit BaseMeasures(const Sources& sources);

  // Base vertices that the measures depend on.
  const std::vector<int>& vertices() const { return vertices_; }

  // Positions are those of vertices(), metres.
  Measures of(const Eigen::Matrix3Xd& positions) const;

  // Whether the survey's definition of a measure is the mesh's.
  static bool is_exact(std::size_t measure);

 private:
  struct Rule {
    enum Kind : std::uint8_t { girth, extent, height, length } kind;
    Tape tape;
    int axis = 0;      // of an extent
    int a = 0, b = 0;  // a height is a's above b, a length from a to b
  };
  std::vector<int> vertices_;
  std::vector<Rule> rules_;  // one a measure
};

}  // namespace gyre
