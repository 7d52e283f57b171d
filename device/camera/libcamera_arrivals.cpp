// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_arrivals.h"

#include <algorithm>

namespace gyre {

namespace lc = libcamera;

void Arrivals::expect(std::size_t requests) {
  queued_.assign(requests, false);
}

void Arrivals::queued(std::uint64_t request) {
  const std::scoped_lock lock(mutex_);
  queued_[request] = true;
  ++counters_.queued;
}

void Arrivals::refused(std::uint64_t request) {
  const std::scoped_lock lock(mutex_);
  queued_[request] = false;
  --counters_.queued;
}

void Arrivals::completed(lc::Request* request) {
  {
    const std::scoped_lock lock(mutex_);
    if (!queued_[request->cookie()]) ++counters_.stray;
    queued_[request->cookie()] = false;
    if (request->status() == lc::Request::RequestCancelled) {
      ++counters_.cancelled;
      cancelled_ = true;
    } else {
      ++counters_.completed;
      done_.push_back(request);
    }
  }
  changed_.notify_one();
}

void Arrivals::disconnected() {
  {
    const std::scoped_lock lock(mutex_);
    gone_ = true;
  }
  changed_.notify_one();
}

Result<lc::Request*> Arrivals::next(std::chrono::steady_clock::time_point until, const std::string& name) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_until(lock, until, [&] { return gone_ || cancelled_ || !done_.empty(); });
  if (gone_) return fail("the device is gone", name, "plug it in again");
  if (done_.empty() && cancelled_) return fail("the stream is broken", name);
  if (done_.empty()) return nullptr;
  lc::Request* const request = done_.front();
  done_.pop_front();
  return request;
}

void Arrivals::clear() {
  const std::scoped_lock lock(mutex_);
  done_.clear();
  cancelled_ = false;
}

void Arrivals::write_off() {
  const std::scoped_lock lock(mutex_);
  counters_.cancelled += std::count(queued_.begin(), queued_.end(), true);
  std::fill(queued_.begin(), queued_.end(), false);
  gone_ = true;
}

bool Arrivals::gone() const {
  const std::scoped_lock lock(mutex_);
  return gone_;
}

CameraCounters Arrivals::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

}  // namespace gyre
