// SPDX-License-Identifier: Apache-2.0
// The scan that is open on the rig: its passes on their way into the spool, and what a restart finds of it.
#pragma once

#include "common/bundle/bundle.h"
#include "device/session/pass_recorder.h"
#include "device/session/session_state.h"
#include "device/session/session_store.h"
#include "device/session/work_queue.h"
#include "device/spool/spool.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

struct OpenScanOptions {
  std::string mode = "orbit";  // or "turn"
  std::string device;
  std::optional<Camera> camera;  // when it is calibrated
  RecorderOptions recorder;
};

// What came of closing a pass.
struct ClosedPass {
  bool is_usable = true;
  std::string text;  // for the operator
  int keyframes = 0;
};

// Belongs to one thread. Every method leaves on disk what the next start needs.
class OpenScan {
 public:
  // folder: of the spool, which outlives this.
  OpenScan(Spool& spool, const std::filesystem::path& folder, OpenScanOptions options);

  // After a start: the state the last run ended in; the scan is as it was then.
  SessionState restore();
  // The state, and with it the scan as it is now.
  Result<void> save(SessionState state) const;

  // Without has_host.
  SessionFacts facts() const;
  const std::optional<Scan>& scan() const { return scan_; }
  const std::string& pass() const { return pass_; }  // that is on, or comes next
  bool is_last_pass() const;

  // Opens a scan when none is open that a pass could be added to.
  void begin(const std::optional<double>& height_mm);

  // The pass begins; frames from 0 follow.
  void start_pass(const CameraInfo& camera);
  // Its recorder; null when none is on.
  const PassRecorder* recorder() const { return recorder_ ? &*recorder_ : nullptr; }
  // Measures a frame and sends what is kept of it on its way; waits when the disk is far behind. turntable: see
  // Coverage.
  void add(Frame frame, std::optional<double> turntable);
  // A picture could not be written.
  std::optional<Error> trouble() const { return writer_.error(); }

  // Each ends the pass that is on. Errors: those of the spool; the pass counts as cut off then.
  Result<ClosedPass> close_pass(const Recall& recall);
  Result<void> drop_pass();

  // Of a pass that was cut off everything is kept that is in the spool, if that is enough.
  Result<ClosedPass> recover_pass();

  Result<void> close_scan();

  // The scan is somebody else's from here on; one of which nothing was kept will be used for the next.
  void forget();

 private:
  std::vector<SpooledFile> spooled() const;
  Result<std::vector<FrameRecord>> records_in_spool(const std::string& pass) const;
  Result<void> passed(const ScanPass& pass, const std::vector<FrameRecord>& records);

  Spool& spool_;
  SessionStore store_;
  OpenScanOptions options_;
  std::vector<std::string> passes_;  // of the mode
  std::optional<Scan> scan_;         // with the passes that are closed
  std::string pass_;
  std::optional<ScanPass> current_;  // the pass that is on or was cut off, as it began
  std::optional<PassRecorder> recorder_;
  WorkQueue writer_;  // its work uses the recorder
};

}  // namespace gyre
