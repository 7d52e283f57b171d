// SPDX-License-Identifier: Apache-2.0
// A scan on disk: the same folder on the board and on the host.
//
//   scan.json  frames.jsonl  frames/<pass>-<index>.jpg  work/<stage>/  avatar.glb  report.html  report.json
#pragma once

#include "common/geometry/camera.h"
#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// One walk around the subject, or one turn of it.
struct ScanPass {
  std::string name;     // "body", "head" or "turn"
  double fps = 0.0;     // of the recording; 0: unknown, as in a folder of photographs
  int frame_count = 0;  // camera frames seen
  int width = 0;        // upright size of its keyframes, pixels
  int height = 0;
  // Focal length of the lens with this field of view on 36 mm x 24 mm film, as the pictures' EXIF says, mm: a guess.
  std::optional<double> focal_35mm;
};

// What scan.json holds.
struct Scan {
  static constexpr int format_version = 1;
  std::string id;                   // ULID
  std::string mode = "orbit";       // "orbit" or "turn"
  std::string device;               // name of the rig
  std::string created;              // ISO 8601, UTC
  std::string software;             // version that wrote it
  std::optional<double> height_mm;  // subject's stature when given
  std::optional<Camera> camera;     // upright camera when calibrated; else stages estimate it
  std::vector<ScanPass> passes;
};

// One line of frames.jsonl: a camera frame, what was measured on it, what was decided and why.
struct FrameRecord {
  std::string pass;
  int index = 0;      // in its pass
  double time = 0.0;  // seconds since the start of the pass
  double motion =
      0.0;  // mean flow to the next frame, pixels of the analysis image; the last frame repeats the one before
  double smoothed_motion = 0.0;
  double sharpness = 0.0;  // variance of the Laplacian of the analysis image
  std::optional<double> exposure_s, gain, lens_position;
  std::optional<double> azimuth;  // of the camera around the subject, degrees from where the pass began
  std::optional<double> height_band;
  std::string decision;  // "keyframe" or "skipped"
  std::string reason;    // a sentence
};

// Path of things inside a bundle folder.
class Bundle {
 public:
  explicit Bundle(std::filesystem::path root) : root_(std::move(root)) {}

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path scan_file() const { return root_ / "scan.json"; }
  std::filesystem::path frame_log() const { return root_ / "frames.jsonl"; }
  std::filesystem::path frames() const { return root_ / "frames"; }
  std::filesystem::path frame(std::string_view pass, int index) const;
  std::filesystem::path work(std::string_view stage) const { return root_ / "work" / stage; }

 private:
  std::filesystem::path root_;
};

// "<pass>-<index, six digits>.jpg"
std::string frame_name(std::string_view pass, int index);

// Pass and index of a keyframe's file name; nothing when it is not one.
struct FrameId {
  std::string pass;
  int index = 0;
  auto operator<=>(const FrameId&) const = default;
};
std::optional<FrameId> parse_frame_name(std::string_view name);

// True for a name that may become a path inside a bundle: known characters, no "..", not absolute.
bool is_safe_name(std::string_view name);

nlohmann::json to_json(const Scan& scan);
Result<Scan> scan_from_json(const nlohmann::json& json);
nlohmann::json to_json(const Camera& camera);
Result<Camera> camera_from_json(const nlohmann::json& json);
nlohmann::json to_json(const FrameRecord& record);
Result<FrameRecord> frame_record_from_json(const nlohmann::json& json);

// Creates the folder with frames/ and writes scan.json.
Result<Bundle> create_bundle(const std::filesystem::path& root, const Scan& scan);
Result<void> write_scan(const Bundle& bundle, const Scan& scan);
Result<Scan> read_scan(const Bundle& bundle);
Result<void> write_frame_log(const Bundle& bundle, const std::vector<FrameRecord>& records);
Result<std::vector<FrameRecord>> read_frame_log(const Bundle& bundle);

// Keyframes on disk, ordered by pass (in the order of scan.passes when read_scan works, else by name) and index.
Result<std::vector<FrameId>> list_frames(const Bundle& bundle);

// Checks that scan.json and frames.jsonl parse, that every record decided "keyframe" has its picture, that pictures
// decode to one size a pass, and that no foreign file lies in frames/. The error names the first fault.
Result<void> verify_bundle(const Bundle& bundle);

}  // namespace gyre
