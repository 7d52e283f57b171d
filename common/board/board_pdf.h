// SPDX-License-Identifier: Apache-2.0
// The board as a page to print.
#pragma once

#include <Eigen/Core>
#include <string>

namespace gyre {

enum class Paper { a4, letter };

// Width and height, metres.
Eigen::Vector2d size_of(Paper paper);

// A PDF 1.4 file of one page in exact lengths: the board, its version and how to print it, and a ruler of 150 mm that
// shows whether the printer has kept the lengths. Vector graphics and a font every reader has; asks the print dialogue
// not to scale.
std::string board_pdf(Paper paper);

}  // namespace gyre
