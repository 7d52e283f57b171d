// SPDX-License-Identifier: Apache-2.0
// Scans on a rig, from a button press to the avatar: takes frames and commands, tells at every moment what to do.
#pragma once

#include "common/result/result.h"
#include "device/camera/fault_ladder.h"
#include "device/camera/steady_camera.h"
#include "device/coverage/turntable_angle.h"
#include "device/session/live_status.h"
#include "device/session/operator_command.h"
#include "device/session/pass_recorder.h"
#include "device/session/session_desk.h"
#include "device/spool/spool.h"
#include "device/uplink/uplink.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace gyre {

struct LiveSessionOptions {
  std::string mode = "orbit";              // passes body and head; or "turn", pass turn
  std::string device;                      // what the rig calls itself
  std::optional<double> height_mm;         // of subjects, when a start does not say
  std::optional<Camera> camera;            // upright, when it is calibrated
  LadderOptions ladder;                    // for a camera that is not there at the start
  std::chrono::milliseconds settle{3000};  // for exposure and focus, before they are held
  RecorderOptions recorder;
  std::uint64_t least_room = std::uint64_t{64} << 20;  // on the disk, to begin a pass, bytes
  std::function<Result<std::uint64_t>()> room;         // on the disk; empty: asks the spool
  const TurntableAngle* turntable = nullptr;           // that the person stands on in a turn; outlives the session

  Result<void> check() const;
};

// How a session ended.
enum class SessionEnd {
  stopped,    // by stop()
  shut_down,  // the operator wants the device to be switched off
};

// Runs on the thread that calls run(), with the camera and what is written to disk on threads of their own; all other
// methods may be called from any thread. What is begun is on disk: after a kill or a power cut at any moment the next
// run goes on with the scan or closes it, says which, and loses no picture that was spooled.
class LiveSession {
 public:
  // A camera for each pass that has one of its own, and one for all others under the name "".
  using Cameras = std::map<std::string, CameraFactory>;

  // folder: of the spool. uplink: null when scans stay here. Spool and uplink outlive this; options.check() must hold.
  LiveSession(Cameras cameras, Spool& spool, const std::filesystem::path& folder, const Uplink* uplink,
              LiveSessionOptions options);
  ~LiveSession();
  LiveSession(const LiveSession&) = delete;
  LiveSession& operator=(const LiveSession&) = delete;

  // Called from the session's thread after every look at camera, commands, disk and host: with every frame, and ten
  // times a second without one. Before run(); several may listen. They must be quick.
  void on_status(std::function<void(const LiveStatus&)> listener);

  void post(const OperatorCommand& command);
  LiveStatus status() const;
  std::optional<Preview> preview() const;  // the last frame

  // Until stop(), or until the operator shuts the device down; a pass that is on is closed before. Error: the camera
  // does not come back, or cannot be what was asked for (wrong use); what was recorded is on disk.
  Result<SessionEnd> run();

  // Ends run() within a few seconds.
  void stop();

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace gyre
