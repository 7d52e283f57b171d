// SPDX-License-Identifier: Apache-2.0
// Whether the disk has room for what comes next.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <functional>

namespace gyre {

// Belongs to one thread.
class DiskWatch {
 public:
  // room: bytes that may still be written. least: bytes that a pass is not begun without.
  DiskWatch(std::function<Result<std::uint64_t>()> room, std::uint64_t least) : room_(std::move(room)), least_(least) {}

  // Looks, once a second. While a pass is on, low is only what closing it may still need; afterwards a little more
  // has to come back than went. A disk that cannot be asked is as it was.
  void look(double now, bool is_recording);

  bool is_low() const { return is_low_; }
  std::uint64_t left() const { return left_; }

 private:
  std::function<Result<std::uint64_t>()> room_;
  std::uint64_t least_;
  std::uint64_t left_ = 0;
  double looked_at_ = -1e9;  // seconds
  bool is_low_ = false;
};

}  // namespace gyre
