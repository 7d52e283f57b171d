// SPDX-License-Identifier: Apache-2.0
// A TCP line that a test can cut in the middle of anything, and make slow.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace gyre {

// Carries every connection made to it on to `port` of this machine.
class TcpProxy {
 public:
  explicit TcpProxy(int port);
  ~TcpProxy();
  TcpProxy(const TcpProxy&) = delete;
  TcpProxy& operator=(const TcpProxy&) = delete;

  std::string endpoint() const { return "tcp://127.0.0.1:" + std::to_string(port_); }
  std::uint64_t carried() const { return carried_; }  // bytes, both ways

  // Cuts all connections once so many more bytes have been carried.
  void cut_after(std::uint64_t bytes) { cut_at_ = carried_ + bytes + 1; }
  // What has been sent to the port since, by whoever was connected.
  void record() { recording_ = true; }
  std::string recorded() const {
    const std::lock_guard lock(mutex_);
    return recorded_;
  }
  // Bytes a second from now on; 0: as many as can be.
  void limit(std::uint64_t bytes_per_s) { limit_ = bytes_per_s; }

 private:
  struct Line {
    int near = -1, far = -1;
  };
  void carry();
  void accept_one();
  bool forward(int from, int to, bool upwards);

  int target_;
  int listener_ = -1;
  int port_ = 0;
  std::vector<Line> lines_;  // of the thread
  std::atomic<std::uint64_t> carried_{0}, cut_at_{0}, limit_{0};
  std::atomic<bool> recording_{false};
  mutable std::mutex mutex_;
  std::string recorded_;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace gyre
