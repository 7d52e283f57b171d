// SPDX-License-Identifier: Apache-2.0
// A face as pictures show it, unrolled onto the cloud's relief: one map in millimetres for all views.
#pragma once

#include "offload/landmarks/detector.h"
#include "offload/landmarks/relief.h"

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace gyre {

// Directions the pictures are taken from, in the face's frame, radians.
struct FaceViewRange {
  double yaw = 0.7;         // to both sides
  double low = -0.5;        // from below (negative) ...
  double high = 0.5;        // ... to above
  double best_pitch = 0.0;  // what is preferred
  int count = 9;            // views at most
};

// Colours over the plane x, y of the face's frame; row 0 is the top, x (the subject's left) grows with the columns.
struct FaceMap {
  static constexpr double cell = 0.0005;  // metres
  Eigen::Vector2d low = Eigen::Vector2d(-0.06, -0.07);
  Eigen::Vector2d high = Eigen::Vector2d(0.06, 0.075);
  Relief relief;
  std::vector<int> views;         // indices into Subject::views, the best first
  std::vector<cv::Mat> pictures;  // CV_32FC3 BGR 0 ... 255, one a view, exposures levelled
  std::vector<double> weights;    // of the pictures in the mean
  cv::Mat mean;                   // their weighted mean
  double resolution = 0.0;        // pixels of the best picture per metre

  Eigen::Vector2d place(double column, double row) const {
    return {low.x() + (column + 0.5) * cell, high.y() - (row + 0.5) * cell};
  }
  cv::Point2d pixel(const Eigen::Vector2d& place) const {
    return {(place.x() - low.x()) / cell - 0.5, (high.y() - place.y()) / cell - 0.5};
  }
};

// The best views of the face by frontality, resolution and sharpness. Empty `views` when none shows it from the front.
// What the relief does not know is black in every map.
FaceMap make_face_map(const Subject& subject, const FaceFrame& frame, const std::vector<Eigen::Vector3d>& head,
                      const FaceViewRange& range = {});

// A place of the map in every picture of it. In each view the place is moved by up to 3 mm to where the picture looks
// most like the mean, so that the views can be triangulated; a view in which nothing is like it is left out.
std::vector<PixelDetection> detections_of(const Subject& subject, const FaceMap& map, const std::string& name,
                                          const Eigen::Vector2d& place, double deviation);

// The place in the world of a place of the mean, at the depth the views agree on: a plane sweep (Collins, "A
// space-sweep approach to true multi-image matching", CVPR 1996) within 6 mm of the relief, of patches that are small
// against what dense stereo can resolve. Nothing when the pictures do not agree on one depth.
std::optional<Eigen::Vector3d> sweep_depth(const Subject& subject, const FaceMap& map, const Eigen::Vector2d& place);

}  // namespace gyre
