// SPDX-License-Identifier: Apache-2.0
#include "common/video/video_file.h"

#include "common/video/orient.h"

#include <cmath>
#include <cstdlib>
#include <opencv2/core/utility.hpp>
#include <opencv2/videoio.hpp>

namespace gyre {

namespace {

// What the container asks a player to do.
Orientation container_orientation(const cv::VideoCapture& video) {
  int clockwise = static_cast<int>(std::lround(video.get(cv::CAP_PROP_ORIENTATION_META)));
  // OpenCV 4.6.0, and only that, reports the rotation with the wrong sign (github.com/opencv/opencv/issues/22088).
  if (cv::getVersionString() == "4.6.0") clockwise = -clockwise;
  switch (((clockwise % 360) + 360) % 360) {
    case 90:
      return Orientation::rotated_90;
    case 180:
      return Orientation::rotated_180;
    case 270:
      return Orientation::rotated_270;
    default:
      return Orientation::upright;
  }
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

class VideoFile : public FrameSource {
 public:
  explicit VideoFile(const std::filesystem::path& file) { info_.path = file; }

  Result<void> open() {
    try {
      // FFmpeg writes its own lines about damaged files; ours names the file and says what to do.
      setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
      if (!video_.open(info_.path.string(), cv::CAP_FFMPEG)) return not_a_video();
      // OpenCV turns frames by itself unless told not to; done here so that it happens exactly once in any version.
      video_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
      orientation_ = container_orientation(video_);
      const double fps = video_.get(cv::CAP_PROP_FPS);
      info_.fps = std::isfinite(fps) && fps > 0.0 ? fps : 30.0;
      info_.expected_frames = static_cast<int>(std::max(0.0, video_.get(cv::CAP_PROP_FRAME_COUNT)));
    } catch (const cv::Exception&) {
      return not_a_video();
    }
    Result<std::optional<Frame>> first = decode();
    if (!first) return tl::unexpected(first.error());
    if (!*first) return not_a_video();
    first_ = std::move(*first);
    return {};
  }

  const CaptureInfo& info() const override { return info_; }

  Result<std::optional<Frame>> next() override {
    if (first_) return std::exchange(first_, std::nullopt);
    return decode();
  }

 private:
  tl::unexpected<Error> not_a_video() const {
    return fail("not a video FFmpeg can read", info_.path.string(), "give a video file or a folder of JPEG or PNG");
  }

  Result<std::optional<Frame>> decode() {
    Frame frame;
    cv::Mat stored;
    try {
      if (!video_.read(stored) || stored.empty()) return std::nullopt;
    } catch (const cv::Exception&) {
      return fail("cannot decode frame " + std::to_string(count_), info_.path.string(), "the video is damaged");
    }
    frame.image = oriented(stored.clone(), orientation_);
    if (count_ == 0) {
      info_.width = frame.image.cols;
      info_.height = frame.image.rows;
    } else if (frame.image.cols != info_.width || frame.image.rows != info_.height) {
      return fail("frames of mixed size",
                  info_.path.string() + " frame " + std::to_string(count_) + " is " +
                      size_text(frame.image.cols, frame.image.rows) + ", the first is " +
                      size_text(info_.width, info_.height),
                  "record the pass again without changing the camera's mode");
    }
    frame.index = count_++;
    // The backend reports no presentation time for the first frame; and some containers carry none at all.
    const double reported = frame.index == 0 ? 0.0 : video_.get(cv::CAP_PROP_POS_MSEC) / 1000.0;
    frame.time = frame.index == 0 || reported > last_time_ ? reported : last_time_ + 1.0 / info_.fps;
    last_time_ = frame.time;
    return frame;
  }

  CaptureInfo info_;
  cv::VideoCapture video_;
  Orientation orientation_ = Orientation::upright;
  std::optional<Frame> first_;
  int count_ = 0;
  double last_time_ = 0.0;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_video(const std::filesystem::path& file) {
  auto video = std::make_unique<VideoFile>(file);
  if (const Result<void> opened = video->open(); !opened) return tl::unexpected(opened.error());
  return video;
}

}  // namespace gyre
