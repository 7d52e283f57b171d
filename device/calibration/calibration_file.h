// SPDX-License-Identifier: Apache-2.0
// Calibrations on the disk of the rig: a file a camera, FOLDER/<camera>.json.
#pragma once

#include "device/calibration/calibrate_camera.h"

#include <filesystem>
#include <optional>
#include <string>

namespace gyre {

// Where that of a camera is kept, by its name (device/camera/camera_name.h) without its settings. Errors: no name of a
// camera.
Result<std::filesystem::path> calibration_file(const std::filesystem::path& folder, const std::string& camera);

// Takes the place of the one before. Errors: no name of a camera, or it cannot be written.
Result<void> write_calibration(const std::filesystem::path& folder, const std::string& camera,
                               const Calibration& calibration);

// The lens of a camera for upright pictures of the size it says; nothing when it was never calibrated. Errors: no name
// of a camera, or the file is damaged.
Result<std::optional<Camera>> read_calibration(const std::filesystem::path& folder, const std::string& camera);

}  // namespace gyre
