// SPDX-License-Identifier: Apache-2.0
// What skin looks like in a face map, and what does not look like it.
#pragma once

#include "offload/landmarks/face_map.h"

namespace gyre {

// CIELAB of a map's mean picture (L 0 ... 100), smoothed by `sigma` metres.
cv::Mat lab_of(const FaceMap& map, double sigma);

// Median of the channels inside a rectangle of places (metres); what the map does not know is left out.
cv::Vec3f median_colour(const FaceMap& map, const cv::Mat& lab, const Eigen::Vector2d& low,
                        const Eigen::Vector2d& high);

}  // namespace gyre
