// SPDX-License-Identifier: Apache-2.0
// A scan out of recordings that no device has made.
#pragma once

#include "common/bundle/bundle.h"
#include "common/log/log.h"

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

namespace gyre {

struct Recording {
  std::string pass;  // "body", "head" or "turn"
  std::filesystem::path capture;
};

// Selects the keyframes of the recordings into `bundle`, whose folder is made and whose frames are replaced. `scan`
// gives id, creation time, device and height; passes and software are filled in. Errors: those of open_capture and of
// the selection, and that `cancel` became true.
Result<Scan> scan_of_recordings(const std::vector<Recording>& recordings, const Bundle& bundle, Scan scan,
                                const Progress& progress, const std::atomic<bool>& cancel);

}  // namespace gyre
