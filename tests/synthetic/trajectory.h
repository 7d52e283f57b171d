// SPDX-License-Identifier: Apache-2.0
// How a hand carries a camera around the synthetic person, in continuous time.
#pragma once

#include "common/geometry/pose.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gyre::synthetic {

enum class Sequence { orbit_body, orbit_head, turn };

struct TrajectoryOptions {
  Sequence sequence = Sequence::orbit_body;
  double duration = 10.0;   // seconds
  double stature = 1.70;    // metres; heights of the camera follow it
  double jitter_mm = 12.0;  // of the hand, about the path; the direction jitters by 0.05 degrees a millimetre
  double sway_deg = 0.0;    // largest lean of the subject about its soles
  bool stop = false;        // the operator stands still for 5 % of the time
  bool rush = false;        // and walks three times too fast for 5 % of it
  double arc_deg = 0.0;     // as in Trouble
  std::uint64_t seed = 1;
};

// Everything is a smooth function of the time in seconds, defined on [0, duration].
class Trajectory {
 public:
  explicit Trajectory(const TrajectoryOptions& options);

  Pose cam_from_world(double time) const;
  // Where the subject stands: turned (sequence `turn`) and leaning.
  Pose world_from_subject(double time) const;
  double yaw(double time) const;           // of the subject, radians, counter-clockwise from above
  double sway_roll(double time) const;     // radians about z
  double sway_pitch(double time) const;    // radians about x
  double speed(double time) const;         // of the camera along its path against the mean: 0 while stopped
  std::string segment(double time) const;  // ring1, transition, ring2, ring, crown, chin, turn
  bool stopped(double time) const;
  bool rushing(double time) const;

 private:
  double progress(double time) const;             // of the path, in [0, 1]
  double wander(double time, int channel) const;  // slow random motion, about in [-1, 1]

  TrajectoryOptions options_;
  std::vector<double> travelled_;  // progress at equal times
};

}  // namespace gyre::synthetic
