// SPDX-License-Identifier: Apache-2.0
// Where the camera is, frame by frame, and what in the middle of the picture moves by itself.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "device/analysis/point_tracks.h"
#include "device/analysis/subject_motion.h"
#include "device/analysis/window_adjustment.h"

#include <deque>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>
#include <vector>

namespace gyre {

struct CameraMotionOptions {
  PointTracksOptions tracks;
  double step = 0.05;          // median way of the points that makes a new view, share of the longer side
  double survivors = 0.7;      // of a view's points, below which there is a new one
  std::size_t window = 8;      // views that are adjusted together
  double noise = 0.5;          // of a point, pixels
  double least_angle = 0.017;  // between two sights of a point that is given a place, radians
  std::size_t least_points = 12;
};

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
  explicit CameraMotionEstimator(const Camera& camera, const CameraMotionOptions& options = {})
      : camera_(camera), options_(options), tracks_(options.tracks) {}

  // The next frame, 8-bit luma, all of one size; time in seconds, ascending.
  CameraMotion add(const cv::Mat& luma, double time);

 private:
  struct View {
    Pose cam_from_first;
    std::map<int, Eigen::Vector2d> seen;  // by the point's number: normalised image point
    double time = 0.0;
    double log_distance = 0.0;
  };

  struct Left {
    double time = 0.0;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
  };

  View sight() const;
  bool begin(View& now);
  bool resect(View& now);
  void keep(View now);
  void place_new_points();
  void adjust();
  void forget_sights(int id);
  void forget_wrong_points();
  void leave_subject();
  std::vector<double> depths_in_the_middle(const View& view) const;
  void measure_distance(std::vector<double> depths);
  void follow_distance(View& now);
  void measure_subject_depth(std::vector<double> depths, const std::optional<double>& radius);
  SubjectShift recent_shift(const View& now);
  std::optional<double> orbit_radius() const;
  std::optional<double> subject_share(const std::vector<double>& depths, const std::optional<double>& radius) const;
  double median_way(const View& from, const View& to) const;
  bool is_near(double depth) const;
  bool is_in_the_middle(const Eigen::Vector2d& at) const;
  double limit() const;
  AdjustmentOptions adjustment() const;

  Camera camera_;
  CameraMotionOptions options_;
  PointTracks tracks_;
  std::deque<View> window_;
  std::map<int, Eigen::Vector3d> points_;  // by number, first camera's axes
  Pose now_from_last_;                     // of the last two frames
  Pose last_;
  double distance_ = 1.0;
  double subject_depth_ = 1.0;  // as distance_, from points that stand where the camera's way turns around
  bool subject_depth_known_ = false;
  double log_distance_ = 0.0;
  std::deque<View> recent_;              // frames of the last third of a second
  std::map<int, Left> left_;             // points that left their places a moment ago, and these
  std::optional<double> moved_at_;       // when the subject moved last
  std::optional<double> subject_share_;  // at the last view
  double last_time_ = 0.0;
  double last_interval_ = 0.0;
};

}  // namespace gyre
