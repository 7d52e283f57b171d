// SPDX-License-Identifier: Apache-2.0
// One pass on its way into the spool: likely keyframes at once, what the exact rule says at its end.
#pragma once

#include "common/bundle/bundle.h"
#include "device/analysis/pass_analysis.h"
#include "device/camera/camera_device.h"
#include "device/coverage/coverage.h"
#include "device/session/recall_buffer.h"
#include "device/session/unsharp_sectors.h"
#include "device/spool/spool.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace gyre {

struct RecorderOptions {
  std::size_t memory = std::size_t{32} << 20;  // for kept frames of a live camera, bytes
  MeasureOptions measure;                      // what selection decides on
  int most_frames = 36'000;                    // of a pass of a live camera; 20 minutes of 30 a second
};

struct RecordingSummary {
  int frames = 0;
  int keyframes = 0;
  int early_keyframes = 0;  // keyframes the host had acknowledged when their pass was stopped
  int early_proposed = 0;   // keyframes that were in the spool then, on their way
  int discarded = 0;        // frames that were spooled and are no keyframes
  int unsharp_sectors = 0;  // that were passed without a sharp frame
};

// Gives frames of a recording once more, as CameraDevice::recall does.
using Recall =
    std::function<Result<void>(const std::vector<int>& indices, const std::function<Result<void>(const Frame&)>& take)>;

// A recording gives every frame again, so that the exact rule may have any. Of a live camera as many compressed frames
// are kept in memory as fit, spread over the whole pass, and the rule chooses among those and the spooled ones; the
// memory for the numbers of all its frames, 48 bytes each, is taken when the pass begins.
class PassRecorder {
 public:
  // scan: as it is when the pass begins, with this pass in it. The spool outlives this.
  PassRecorder(Spool& spool, Scan scan, std::string pass, CameraInfo camera, const RecorderOptions& options = {});

  // What is to be done with pictures after a frame was added, in this order.
  struct Picked {
    std::optional<Frame> likely;  // for keep()
    std::optional<Frame> spare;   // for remember()
  };
  // Measures the next frame; indices from 0 without holes. turntable: see Coverage. This and what follows up to pass()
  // belongs to one thread.
  Picked add(Frame frame, std::optional<double> turntable = {});

  const FrameReading& reading() const { return analysis_.reading(); }
  // Where the frame added last was taken from; nothing of photographs, which are too far apart.
  const std::optional<CoverageReading>& place() const { return place_; }
  const CoverageMap& map() const { return coverage_.map(); }
  int frames() const { return analysis_.count(); }
  // A live camera has given as many frames as a pass may have, and the pass should be ended.
  bool is_full() const { return camera_.live && frames() >= most_frames_; }
  ScanPass pass() const;

  // Compress pictures and put them away; may take place on another thread, one at a time. The scan appears in the spool
  // with its first frame, so that a recording without movement leaves nothing.
  Result<void> keep(const Frame& likely);
  Result<void> remember(const Frame& spare);

  // The exact rule over all frames, and the least bad frame of sectors without a sharp one. Errors: the pass is too
  // short, or the camera did not move.
  Result<Selection> decide() const;

  // Makes the pass in the spool what the selection says: takes back what is no keyframe and adds what is missing, from
  // what was remembered or from the camera's recording. Returns the pass's lines of frames.jsonl. Errors: those of
  // spool and camera.
  Result<std::vector<FrameRecord>> finish(const Selection& selection, const Recall& recall, RecordingSummary& summary);

 private:
  Result<void> store(int index, const std::string& jpeg);
  std::set<int> spooled() const;
  Result<std::set<int>> settle(const std::set<int>& keyframes, RecordingSummary& summary);
  std::optional<Frame> spare_of(Frame frame);

  Spool& spool_;
  Scan scan_;
  std::string name_;
  CameraInfo camera_;
  int most_frames_;
  PassAnalysis analysis_;
  Coverage coverage_;
  std::optional<CoverageReading> place_;
  std::vector<FramePlace> places_;  // by frame
  RecallBuffer remembered_;
  std::optional<Frame> sharpest_;  // of the last few frames of a camera that does not compress
  double sharpness_ = 0.0;
};

}  // namespace gyre
