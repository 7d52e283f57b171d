// SPDX-License-Identifier: Apache-2.0
// The printed board in a reconstruction: where it lies and what it says of the scale.
#pragma once

#include "common/board/find_board.h"
#include "offload/cameras/scene.h"

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace gyre {

struct PlacedBoard {
  double scale = 1.0;                                 // metres a unit of the reconstruction
  double uncertainty = 0.0;                           // standard deviation of the scale, as a share
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // of its corners, in the reconstruction
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // out of the printed side, unit length
  int corners = 0;
  int views = 0;  // that see at least one of these corners where it is
};

// Triangulates the corners found in the registered views (`seen`: one list per view of the scene) and fits the board to
// them. A corner that its views do not agree on to 2 pixels, or whose distances to the others are wrong, is left out.
// The uncertainty is that of a regression of the reconstructed on the known corners, and how well a ruler tells that
// the sheet was printed in its true size. Nothing when three views of four corners are not left.
std::optional<PlacedBoard> place_board(const Scene& scene, const std::vector<std::vector<BoardCorner>>& seen);

}  // namespace gyre
