// SPDX-License-Identifier: Apache-2.0
#include "device/camera/camera_clock.h"
#include "device/camera/camera_device.h"
#include "device/camera/camera_name.h"
#include "device/camera/faulty_replay.h"
#include "device/camera/libcamera_camera.h"
#include "device/camera/replay_camera.h"
#include "device/camera/steady_camera.h"
#include "device/camera/v4l2_camera.h"

namespace gyre {

namespace {

Result<std::unique_ptr<CameraDevice>> open_faulty_replay(const CameraName& name, Pace pace) {
  Result<std::vector<Fault>> faults = read_fault_script(name.faults);
  if (!faults) return tl::unexpected(faults.error());
  Result<std::unique_ptr<CameraDevice>> recording = open_replay_camera(name.target, Pace::fast);
  if (!recording) return recording;
  std::shared_ptr<CameraClock> clock = std::make_shared<MachineClock>();
  if (pace == Pace::fast) clock = std::make_shared<ReplayClock>();
  const auto replay = std::make_shared<FaultyReplay>(std::move(*recording), std::move(*faults), clock);
  return open_steady_camera([replay] { return replay->open(); }, clock);
}

Result<std::unique_ptr<CameraDevice>> open_live(const CameraName& name) {
  CameraFactory open = [name] { return open_libcamera(name); };
  if (name.kind == CameraName::Kind::v4l2)
    open = [name, identity = std::string()]() mutable { return open_v4l2_camera(name, identity); };
  return open_steady_camera(std::move(open), std::make_shared<MachineClock>());
}

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_camera(const std::string& name, Pace pace) {
  const Result<CameraName> parsed = parse_camera_name(name);
  if (!parsed) return tl::unexpected(parsed.error());
  if (parsed->kind != CameraName::Kind::replay) return open_live(*parsed);
  if (!parsed->faults.empty()) return open_faulty_replay(*parsed, pace);
  return open_replay_camera(parsed->target, pace);
}

}  // namespace gyre
