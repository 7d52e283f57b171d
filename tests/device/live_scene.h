// SPDX-License-Identifier: Apache-2.0
// A live camera that walks along a texture and back, until a test takes it away.
#pragma once

#include "device/camera/camera_device.h"

#include <atomic>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <thread>

namespace gyre::test {

// What a test and its camera share.
struct SceneSwitches {
  std::atomic<bool> is_there{true};    // else the camera cannot be opened, and one that is open is being brought back
  std::atomic<bool> settles{true};     // else it never holds its exposure
  std::atomic<bool> is_broken{false};  // it will not come back
  std::atomic<bool> moves{true};
  std::optional<double> time_zero;  // see CameraDevice; before the camera is opened
};

class LiveScene : public CameraDevice {
 public:
  explicit LiveScene(SceneSwitches& switches) : switches_(switches) {
    info_ = {.name = "live scene", .width = 96, .height = 64, .fps = 30.0, .live = true};
    constexpr int length = 1500;
    texture_.create(info_.height, info_.width + step * length, CV_8UC3);
    cv::RNG random(11);
    random.fill(texture_, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture_, texture_, {}, 2.0);
  }

  const CameraInfo& info() const override { return info_; }
  Result<void> start() override { return {}; }
  void stop() override {}
  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (switches_.is_broken) return fail("the camera does not come back", info_.name);
    if (!switches_.is_there) {
      std::this_thread::sleep_for(timeout);
      return CameraEvent{CameraEvent::Kind::timeout, std::nullopt, true};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(3));  // its pace
    return CameraEvent{CameraEvent::Kind::frame, frame(next_++)};
  }
  void lock(std::chrono::milliseconds) override { is_locked_ = true; }
  void unlock() override { is_locked_ = false; }
  std::optional<double> time_zero() const override { return switches_.time_zero; }
  CameraLock locked() const override {
    if (!is_locked_) return CameraLock::automatic;
    return switches_.settles ? CameraLock::held : CameraLock::settling;
  }

 private:
  static constexpr int step = 2;

  Frame frame(int index) {
    if (switches_.moves) ++at_;
    const int ways = (texture_.cols - info_.width) / step;
    const int there = at_ % (2 * ways);
    const cv::Rect view(step * std::min(there, 2 * ways - there), 0, info_.width, info_.height);
    Frame frame{.index = index, .time = index / info_.fps, .image = texture_(view).clone()};
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", frame.image, bytes);
    frame.jpeg.assign(bytes.begin(), bytes.end());
    return frame;
  }

  SceneSwitches& switches_;
  CameraInfo info_;
  cv::Mat texture_;
  int next_ = 0;
  int at_ = 0;
  bool is_locked_ = false;
};

}  // namespace gyre::test
