// SPDX-License-Identifier: Apache-2.0
// Coverage of one pass, live: where the camera is around the subject, and what it has seen from there.
#pragma once

#include "device/analysis/frame_analysis.h"
#include "device/coverage/coverage_map.h"
#include "device/coverage/loop_closure.h"
#include "device/coverage/orbit.h"

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace gyre {

struct CoverageReading {
  OrbitPlace place;
  Band band = Band::body_upper;
  // The start of the ring the camera is on has been seen again after a full turn, or the turntable has made one.
  bool is_closed = false;
};

// Belongs to one thread.
class Coverage {
 public:
  // pass: "body", "head" or "turn".
  Coverage(std::string pass, const Camera& camera) : pass_(std::move(pass)), camera_(camera) {}

  // The next frame as it was measured, and the luma of that. turntable: angle of the subject, radians,
  // counter-clockwise seen from above, of frames for which a turntable tells it; it alone says the azimuth then, and
  // the picture only whether it is sharp. Of a turn without one nothing is known: the picture says how the camera
  // stands and not how the subject does. A frame whose place is not known covers nothing.
  CoverageReading add(const FrameReading& frame, const cv::Mat& luma, std::optional<double> turntable = {});

  const CoverageMap& map() const { return map_; }

 private:
  struct Start {
    RememberedView view;
    Orbit::Mark mark;
    std::optional<double> seen_drift;  // at the last look, when the view was seen
    bool is_closed = false;
  };
  CoverageReading turned(const FrameReading& frame, std::optional<double> turntable);
  void look_for_start(Start& start, const FrameReading& frame, const cv::Mat& luma, CoverageReading& reading);

  std::string pass_;
  Camera camera_;
  Orbit orbit_;
  CoverageMap map_;
  std::optional<Band> band_;
  std::array<std::optional<Start>, all_bands.size()> starts_;  // of the rings, by band
  std::optional<double> turntable_start_;                      // at azimuth 0
  double turned_ = 0.0;                                        // last azimuth that the turntable told
  int frames_since_look_ = 0;
};

}  // namespace gyre
