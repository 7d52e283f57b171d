// SPDX-License-Identifier: Apache-2.0
// What is done about a camera that does not deliver, step by step: the stream is started again, the device is opened
// again, and finally it is given up, so that the service manager starts the whole program again. Pure: time comes in.
#pragma once

#include "common/result/result.h"

namespace gyre {

struct LadderOptions {
  double silence = 3.0;          // seconds without a frame that count as a failure; cold sensors take a second
  int restarts = 2;              // of the stream, before the device is opened again
  double between_reopens = 1.0;  // seconds; a plug that is put back takes some to be there
  double patience = 60.0;        // seconds of failures until the camera is given up
  double calm = 5.0;             // seconds of frames after which a failure is a new one

  Result<void> check() const;
};

enum class LadderStep { none, restart, reopen, give_up };

// All times in seconds of one clock that never goes back. options.check() must hold.
class FaultLadder {
 public:
  explicit FaultLadder(const LadderOptions& options = {}) : options_(options) {}

  // The stream was started by who uses the camera.
  void started(double now);
  void frame(double now);

  // What is to be done when no frame came, or when asking for one (or the step before) was an error.
  LadderStep silent(double now);
  LadderStep failed(double now);

  // When silent() will have something to do at the earliest.
  double next_step() const;

  // A failure was noticed and no frame has come since.
  bool recovering() const { return recovering_; }

 private:
  LadderStep escalate(double now);

  LadderOptions options_;
  double quiet_since_ = 0.0;    // last frame, start or step
  double trouble_since_ = 0.0;  // of the trouble that is not over
  double frames_since_ = 0.0;   // first frame after the last step
  double reopened_ = 0.0;
  int restarts_ = 0;
  int reopens_ = 0;
  bool trouble_ = false;
  bool recovering_ = false;
};

}  // namespace gyre
