// SPDX-License-Identifier: Apache-2.0
// Picks, of the pictures of a camera that is held in front of the board, those that a calibration needs.
#pragma once

#include "device/calibration/calibrate_camera.h"

#include <string>

namespace gyre {

// Belongs to one thread.
class ViewCollector {
 public:
  static constexpr int wanted_views = 24;
  static constexpr double wanted_cover = 0.85;  // see covered()

  ViewCollector(int width, int height) : width_(width), height_(height) {}

  // The next picture's board, empty when there is none. Taken when it is held still and shows something new.
  bool add(const BoardView& view);

  bool is_enough() const;
  double fraction() const;  // of what is wanted, 0 to 1
  // What the person is to do next, a sentence.
  std::string advice() const;
  const std::vector<BoardView>& views() const { return views_; }

 private:
  int width_, height_;
  std::vector<BoardView> views_;
  BoardView last_;
  bool moved_ = false;  // the last one, against the one before
};

}  // namespace gyre
