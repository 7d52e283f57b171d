// SPDX-License-Identifier: Apache-2.0
// What libcamera's thread tells of an opened camera, for the thread that takes its frames.
#pragma once

#include "common/result/result.h"
#include "device/camera/camera_device.h"

#include <libcamera/request.h>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

namespace gyre {

// Requests are told apart by their cookies, numbers from 0. The call-backs completed() and disconnected() only write
// down and never wait.
class Arrivals {
 public:
  void expect(std::size_t requests);

  // Before the request is queued: it may be back before queueRequest() is.
  void queued(std::uint64_t request);
  void refused(std::uint64_t request);

  void completed(libcamera::Request* request);
  void disconnected();

  // The next request that came back with pictures; null when none did in time. Errors: the camera is gone, or its
  // requests came back without pictures, which is how a stream breaks.
  Result<libcamera::Request*> next(std::chrono::steady_clock::time_point until, const std::string& name);

  // The stream was stopped, and everything is back.
  void clear();

  // Nothing will come back any more.
  void write_off();

  bool gone() const;
  CameraCounters counters() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<libcamera::Request*> done_;
  std::vector<bool> queued_;  // by request
  CameraCounters counters_;
  bool cancelled_ = false;
  bool gone_ = false;
};

}  // namespace gyre
