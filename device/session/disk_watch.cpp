// SPDX-License-Identifier: Apache-2.0
#include "device/session/disk_watch.h"

#include <spdlog/spdlog.h>

namespace gyre {

void DiskWatch::look(double now, bool is_recording) {
  constexpr double every = 1.0;
  constexpr std::uint64_t closing = 16U << 20;
  if (now - looked_at_ < every) return;
  looked_at_ = now;
  const Result<std::uint64_t> room = room_();
  if (!room) {
    spdlog::error("{}", room.error().message());
    return;
  }
  left_ = *room;
  const std::uint64_t least = is_recording ? closing : is_low_ ? least_ / 4 * 5 : least_;
  is_low_ = left_ < least;
}

}  // namespace gyre
