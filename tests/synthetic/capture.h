// SPDX-License-Identifier: Apache-2.0
// A synthetic capture: what is known exactly about every frame, and the frame itself.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "tests/synthetic/appearance.h"
#include "tests/synthetic/room.h"
#include "tests/synthetic/subject.h"
#include "tests/synthetic/trajectory.h"
#include "tests/synthetic/trouble.h"

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

namespace gyre::synthetic {

struct CaptureOptions {
  Sequence sequence = Sequence::orbit_body;
  int width = 360;
  int height = 640;
  int frames = 150;
  double fps = 15.0;
  double stature = 1.70;         // metres
  double noise = 2.0;            // standard deviation at mid grey, 8-bit levels; shot noise makes it follow the signal
  double exposure_drift = 0.05;  // largest change of gain against 1
  double jitter_mm = 12.0;       // of the hand
  double sway_deg = 0.0;         // largest lean of the subject
  double defocus_px = 0.0;       // radius of the blur disc while the focus hunts (3 % of the frames); 0: never
  bool stop = true;              // the operator stops once
  bool rush = true;              // and hurries once; those frames are blurred by motion
  int samples = 1;               // a pixel's side, in rays: 2 smooths edges and takes four times as long
  double cell = 0.012;           // size of the subject's mesh cells, metres
  Trouble trouble;
  std::uint64_t seed = 1;
};

// The truth of one frame.
struct FrameTruth {
  int index = 0;
  double time = 0.0;  // mid exposure, seconds
  Pose cam_from_world;
  Pose world_from_subject;
  bool blurred = false, defocused = false, stopped = false;
  double exposure_s = 0.0;  // > 0 when blurred
  double defocus_radius_px = 0.0;
  double gain = 1.0;
  double speed_deg_s = 0.0;  // of the camera's direction seen from the subject's axis
  double subject_yaw = 0.0, sway_roll = 0.0, sway_pitch = 0.0;  // radians
  std::string segment;
};

// Somebody else in the room, in other clothes.
struct PasserBy {
  Subject subject;
  Appearance appearance{1};
};

struct Capture {
  CaptureOptions options;
  Camera camera;
  Subject subject;  // in its own axes: frame i shows it moved by frames[i].world_from_subject
  Room room;
  Appearance appearance{1};
  std::optional<PasserBy> passer_by;
  Trajectory trajectory{{}};
  // Pictures follow the poses of the frames, which may be changed.
  std::vector<FrameTruth> frames;
};

// Deterministic in the options: the same seed gives the same pixels on any number of threads.
Capture make_capture(const CaptureOptions& options = {});

// 8-bit BGR as the camera saw it, on one thread; frames may be rendered in any order and at the same time.
cv::Mat render_frame(const Capture& capture, int index);

// 255 where the frame's mid exposure shows the subject, else 0.
cv::Mat render_mask(const Capture& capture, int index);

// A joint of frame `index`, in the world.
Eigen::Vector3d joint_position(const Capture& capture, int index, const NamedJoint& joint);

}  // namespace gyre::synthetic
