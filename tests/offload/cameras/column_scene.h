// SPDX-License-Identifier: Apache-2.0
// A patterned column in a round patterned room, as pictures from a ring with known poses.
#pragma once

#include "offload/cameras/scene.h"

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

// The true scene: views on the ring, registered; tracks of points on the column and on the wall, with all observations.
struct Column {
  Scene scene;

  // What a view sees from its pose while it moves on along the ring by `sweep` radians during the exposure, the pose
  // being the middle; 8-bit grey.
  cv::Mat picture(int view, double sweep = 0.0) const;

  // What the first view's camera sees when the column has turned as far as the view has gone along the ring, and the
  // room stays; 8-bit grey.
  cv::Mat turned_picture(int view) const;
};

Column make_column(int views);

}  // namespace gyre
