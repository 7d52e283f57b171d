// SPDX-License-Identifier: Apache-2.0
// Where the camera is, frame by frame, and what in the middle of the picture moves by itself.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "device/analysis/point_tracks.h"
#include "device/analysis/subject_distance.h"
#include "device/analysis/subject_watch.h"
#include "device/analysis/view_map.h"

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace gyre {

struct CameraMotion {
  // The first frame's camera is the world; the unit of length is the first known distance to the subject, as far as it
  // can be carried along. While `known` is false the camera is assumed to go on as it went.
  Pose cam_from_first;
  bool known = true;
  bool is_view = false;           // points joined and places were adjusted in this frame
  double subject_distance = 1.0;  // to what stands nearest in the middle of the picture, the same unit
  double subject_motion = 0.0;    // pixels; see below
  // Logarithm of the distance to the subject against the first: how the depths of its points changed from frame to
  // frame, which needs no unit of length. Slides by a hundredth or two a second.
  double log_distance = 0.0;
  // Share of the points in the middle of the picture that stand where the camera's way turns around; nothing while it
  // does not turn, is not known, or the subject moved just now.
  std::optional<double> subject_share;
};

// Visual odometry: points are followed, a few recent views and the points' places are adjusted together, and every
// frame is resected from them (Klein and Murray, "Parallel Tracking and Mapping", ISMAR 2007, without a lasting map).
//
// The subject's own motion is how far its points moved against the room within the last third of a second: leaning,
// turning and stepping aside. It is in pixels of a camera at an easy pace; of a faster one the same shift counts for
// less, as it is known less well. Where the room is too far behind to tell the camera's way, as of a head from near, a
// shift of the whole subject looks like one of the camera and is not seen. While the subject moves the camera goes by
// the room alone.
//
// A camera that goes around somebody has them at the radius of its way. When nobody stands there the middle of the
// picture shows the room behind, at a multiple of it; and of a camera that pans on the spot the radius is none.
class CameraMotionEstimator {
 public:
  // camera: of frames as they were recorded; the luma may be smaller.
  explicit CameraMotionEstimator(const Camera& camera) : camera_(camera), map_(camera) {}

  // The next frame, 8-bit luma, all of one size; time in seconds, ascending.
  CameraMotion add(const cv::Mat& luma, double time);

 private:
  View sight() const;
  bool begin(View& now);
  bool resect(View& now);
  void keep(View now);
  std::vector<double> depths_in_the_middle() const;
  std::optional<double> orbit_radius() const;
  double median_way(const View& from, const View& to) const;

  Camera camera_;
  PointTracks tracks_;
  ViewMap map_;
  SubjectDistance distance_;
  SubjectWatch watch_;
  Pose now_from_last_;  // of the last two frames
  Pose last_;
  std::optional<double> subject_share_;  // at the last view
  double last_time_ = 0.0;
  double last_interval_ = 0.0;
};

}  // namespace gyre
