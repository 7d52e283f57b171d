// SPDX-License-Identifier: Apache-2.0
// One scan without an operator: passes one after the other from cameras that end by themselves into the spool.
#pragma once

#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "device/camera/camera_device.h"
#include "device/session/pass_recorder.h"
#include "device/spool/spool.h"

#include <span>
#include <string>

namespace gyre {

struct PassPlan {
  std::string name;  // "body", "head" or "turn"
  CameraDevice* camera = nullptr;
};

// Records the passes into the spool and closes the scan. `scan` gives id, creation time, device and height; passes are
// filled in here. While a pass goes on, likely keyframes go to the spool, where the uplink takes them from; at its stop
// the exact rule decides, the difference is taken back or recalled from the camera, and every frame's decision is
// logged. The scan appears in the spool with its first frame, so that a recording without movement leaves nothing.
//
// The same cameras give the same scan: after a crash at any moment the call is repeated with the same id, and what is
// in the spool already is neither written nor sent again. Does nothing for a scan that is closed. Errors: those of the
// cameras, the selection and the spool; what was recorded stays in the spool.
Result<RecordingSummary> record_scan(Spool& spool, Scan scan, std::span<const PassPlan> passes,
                                     const RecorderOptions& options, const Progress& progress);

}  // namespace gyre
