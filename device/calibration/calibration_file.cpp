// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/calibration_file.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/log/utc_time.h"
#include "device/camera/camera_name.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Size, format and the like belong to a recording, the lens to the camera.
Result<std::string> bare_name(const std::string& camera) {
  const Result<CameraName> parsed = parse_camera_name(camera);
  if (!parsed) return tl::unexpected(parsed.error());
  CameraName bare;
  bare.kind = parsed->kind;
  bare.target = parsed->target;
  return to_string(bare);
}

}  // namespace

Result<fs::path> calibration_file(const fs::path& folder, const std::string& camera) {
  constexpr std::size_t longest = 200;  // a path may be longer than a file name; its end tells more
  Result<std::string> name = bare_name(camera);
  if (!name) return tl::unexpected(name.error());
  std::ranges::replace_if(
      *name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '.' && c != '-'; }, '_');
  if (name->size() > longest) name = name->substr(name->size() - longest);
  return folder / (*name + ".json");
}

Result<void> write_calibration(const fs::path& folder, const std::string& camera, const Calibration& calibration) {
  const Result<fs::path> file = calibration_file(folder, camera);
  if (!file) return tl::unexpected(file.error());
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail("cannot create the folder", folder.string() + " (" + error.message() + ")");
  const json record = {{"camera", *bare_name(camera)},
                       {"calibrated", utc_now()},
                       {"model", to_json(calibration.camera)},
                       {"views", calibration.views},
                       {"reprojection_error_px", calibration.error},
                       {"covered", calibration.covered},
                       {"focal_deviation", calibration.focal_deviation}};
  return write_file(*file, record.dump(2) + "\n");
}

Result<std::optional<Camera>> read_calibration(const fs::path& folder, const std::string& camera) {
  const Result<fs::path> file = calibration_file(folder, camera);
  if (!file) return tl::unexpected(file.error());
  std::error_code error;
  if (!fs::exists(*file, error)) return std::nullopt;
  const Result<std::string> text = read_file(*file);
  if (!text) return tl::unexpected(text.error());
  const json record = json::parse(*text, nullptr, false);
  const auto damaged = [&] {
    return fail("the calibration is damaged", file->string(), "run gyre-device calibrate again, or remove it");
  };
  if (!record.is_object() || !record.contains("model")) return damaged();
  // Another name may look the same in letters a file name can have.
  if (record.value("camera", json()) != *bare_name(camera)) return std::nullopt;
  const Result<Camera> model = camera_from_json(record["model"]);
  if (!model) return damaged();
  return *model;
}

}  // namespace gyre
