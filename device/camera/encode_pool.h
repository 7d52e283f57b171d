// SPDX-License-Identifier: Apache-2.0
// Raw pictures that may be wanted as JPEG: compressed by a few threads when somebody asks, and never more of them in
// memory than agreed.
#pragma once

#include "common/video/frame_source.h"
#include "device/camera/jpeg.h"

#include <cstddef>
#include <memory>

namespace gyre {

struct EncodeOptions {
  int threads = 2;
  int quality = 95;
  // Of raw pictures that are alive: the dozen frames a selection waits for, of 1080p with room to spare. Above three
  // quarters of it the oldest are compressed before anybody has asked.
  std::size_t most_bytes = std::size_t{96} << 20;
};

class EncodePool {
 public:
  explicit EncodePool(const EncodeOptions& options = {});
  EncodePool(const EncodePool&) = delete;
  EncodePool& operator=(const EncodePool&) = delete;
  // Pictures that are still held can be asked for afterwards too; whoever asks then compresses.
  ~EncodePool();

  // A picture to be asked for later, or nothing when there is no room: then the frame has to be left out.
  std::shared_ptr<const FullPicture> keep(RawPicture picture);

  std::size_t bytes() const;  // of raw pictures alive
  int compressed() const;     // pictures so far

 private:
  struct State;
  class Picture;
  std::shared_ptr<State> state_;
};

}  // namespace gyre
