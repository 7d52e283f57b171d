// SPDX-License-Identifier: Apache-2.0
// Where the session and everybody else meet: commands come in, status and pictures go out.
#pragma once

#include "device/session/live_status.h"
#include "device/session/operator_command.h"

#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>
#include <vector>

namespace gyre {

// One picture of the camera, as it is measured.
struct Preview {
  int number = 0;  // of the frame, ascending
  cv::Mat image;   // 8-bit BGR, upright; nobody writes to it any more
};

// From any thread, but for on_status and tell, which are the session's.
class SessionDesk {
 public:
  using Listener = std::function<void(const LiveStatus&)>;

  void on_status(Listener listener) { listeners_.push_back(std::move(listener)); }
  void tell(LiveStatus status) {
    const auto told = std::make_shared<const LiveStatus>(std::move(status));
    {
      const std::lock_guard lock(mutex_);
      status_ = told;
    }
    for (const Listener& listener : listeners_) listener(*told);
  }
  LiveStatus status() const {
    const std::lock_guard lock(mutex_);
    return *status_;
  }

  void show(const cv::Mat& image) {
    const std::lock_guard lock(mutex_);
    preview_ = Preview{preview_ ? preview_->number + 1 : 0, image};
  }
  std::optional<Preview> preview() const {
    const std::lock_guard lock(mutex_);
    return preview_;
  }

  void post(const OperatorCommand& command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
  }
  std::vector<OperatorCommand> take_commands() {
    const std::lock_guard lock(mutex_);
    return std::exchange(commands_, {});
  }

 private:
  std::vector<Listener> listeners_;
  mutable std::mutex mutex_;  // guards what follows
  std::vector<OperatorCommand> commands_;
  std::shared_ptr<const LiveStatus> status_ = std::make_shared<const LiveStatus>();
  std::optional<Preview> preview_;
};

}  // namespace gyre
