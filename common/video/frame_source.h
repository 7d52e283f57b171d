// SPDX-License-Identifier: Apache-2.0
// The frames of a recorded capture, a video file or a folder of pictures, one after the other and upright.
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace gyre {

// A picture that is compressed only when somebody wants it. Used from one thread.
class FullPicture {
 public:
  FullPicture() = default;
  FullPicture(const FullPicture&) = delete;
  FullPicture& operator=(const FullPicture&) = delete;
  virtual ~FullPicture() = default;

  virtual Result<std::string> jpeg() const = 0;
};

// How the camera was set when it took a frame, as far as it says so.
struct FrameSettings {
  std::optional<double> exposure_s;
  std::optional<double> gain;           // as the camera counts it; libcamera: 1 is none
  std::optional<double> lens_position;  // dioptres, 0: infinity

  bool operator==(const FrameSettings&) const = default;
};

struct Frame {
  int index = 0;      // from 0, without holes
  double time = 0.0;  // seconds since the first frame
  cv::Mat image;      // 8-bit BGR, upright; of a camera it may be smaller than the picture, as its keyframe is `jpeg`
  std::string jpeg;   // the stored file when that already is an upright JPEG, so that nothing is compressed twice
  std::shared_ptr<const FullPicture> full;  // in place of `jpeg`, from cameras that give raw pictures
  FrameSettings settings;
};

struct CaptureInfo {
  std::filesystem::path path;
  bool pictures = false;  // a folder of pictures instead of a video
  int width = 0;          // upright, pixels
  int height = 0;
  double fps = 0.0;                  // nominal; 0 for a folder
  int expected_frames = 0;           // exact for a folder, the container's claim for a video; 0: unknown
  std::optional<double> focal_35mm;  // as the first picture's EXIF says, see ExifFacts
};

// Belongs to one thread.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  virtual const CaptureInfo& info() const = 0;

  // The next frame; nothing after the last. Errors: a picture that cannot be decoded, or one of another size than the
  // first (after it was turned upright).
  virtual Result<std::optional<Frame>> next() = 0;
};

// Opens a video (whatever FFmpeg reads; the rotation its container asks for is applied, once) or a folder (JPEG and
// PNG in the order of their names, where numbers count as numbers: img-9 comes before img-10; EXIF orientation
// applied; a picture is one second after the one before). Decodes the first frame, so that the info is true.
// Errors: nothing at that path, a file without a video in it, a folder without pictures, an unreadable first frame.
Result<std::unique_ptr<FrameSource>> open_capture(const std::filesystem::path& path);

}  // namespace gyre
