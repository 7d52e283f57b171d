// SPDX-License-Identifier: Apache-2.0
// Eyes, teeth, tongue and lashes follow the body around them.
#pragma once

#include "offload/body/face_openings.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Places every part but the body by what its surroundings went through from `before` to `after`. Both arrays hold the
// whole template; in `after` the body is final.
//
// An eye moves by the similarity of the skin around it, with a size that stays near the one it had, as grown people's
// eyeballs differ by a few per cent only, and is then seated behind its lids as deep as it was. Teeth and tongue move
// together, so that the bite stays closed. Lashes hang on the lids. A part that is none of these moves by the
// similarity of its surroundings. Where surroundings say nothing (fewer than three vertices, or a change of size beyond
// a half), the part keeps its size and takes their mean shift.
void carry_inner_parts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& before,
                       std::vector<Eigen::Vector3d>& after);

// Lashes as points that hang on the rims of the lids: each takes the motion of the rims, the nearest parts most.
class LashBinding {
 public:
  // rest: the whole template. Without lashes or lids, there is nothing to move.
  LashBinding(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest);

  // Motion of each lash vertex, in order, for a motion of the whole template's vertices from `from` to `to`.
  std::vector<Eigen::Vector3d> motion(const std::vector<Eigen::Vector3d>& from,
                                      const std::vector<Eigen::Vector3d>& to) const;
  int first_vertex() const { return first_; }

 private:
  int first_ = 0;
  std::vector<int> rim_;
  Eigen::MatrixXd weights_;  // lash vertices x rim vertices; rows sum to 1
};

}  // namespace gyre
