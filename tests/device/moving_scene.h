// SPDX-License-Identifier: Apache-2.0
// A camera whose picture slides over a texture: frames that selection can work on, without any file.
#pragma once

#include "device/camera/camera_device.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre::test {

class MovingScene : public CameraDevice {
 public:
  explicit MovingScene(int frames, int pixels_per_frame = 2) : frames_(frames), step_(pixels_per_frame) {
    info_ = {.name = "scene", .width = 96, .height = 64, .fps = 15.0, .expected_frames = frames};
    texture_.create(info_.height, info_.width + step_ * frames, CV_8UC3);
    cv::RNG random(11);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, {}, 2.0);
  }

  const CameraInfo& info() const override { return info_; }
  Result<void> start() override {
    next_ = 0;
    return {};
  }
  void stop() override {}
  Result<CameraEvent> next(std::chrono::milliseconds) override {
    if (next_ == frames_) return CameraEvent{CameraEvent::Kind::ended, std::nullopt};
    return CameraEvent{CameraEvent::Kind::frame, frame(next_++)};
  }
  Result<void> recall(const std::vector<int>& indices, const std::function<Result<void>(const Frame&)>& take) override {
    for (const int index : indices) {
      recalled_.push_back(index);
      if (const Result<void> taken = take(frame(index)); !taken) return taken;
    }
    return {};
  }

  const std::vector<int>& recalled() const { return recalled_; }

 private:
  Frame frame(int index) const {
    const cv::Rect view(step_ * index, 0, info_.width, info_.height);
    return {.index = index, .time = index / info_.fps, .image = texture_(view).clone(), .jpeg = {}};
  }

  CameraInfo info_;
  int frames_;
  int step_;
  int next_ = 0;
  cv::Mat texture_;
  std::vector<int> recalled_;
};

}  // namespace gyre::test
