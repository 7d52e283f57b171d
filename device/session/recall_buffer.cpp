// SPDX-License-Identifier: Apache-2.0
#include "device/session/recall_buffer.h"

#include <algorithm>

namespace gyre {

void RecallBuffer::clear() {
  kept_.clear();
  bytes_ = 0;
  stride_ = 1;
}

void RecallBuffer::add(const Frame& frame) {
  if (frame.jpeg.empty() || frame.jpeg.size() > limit_) return;
  Kept added{frame.index, frame.time, frame.jpeg, frame.settings};
  if (!kept_.empty() && kept_.back().index / stride_ == added.index / stride_) {
    if (added.jpeg.size() <= kept_.back().jpeg.size()) return;
    bytes_ -= kept_.back().jpeg.size();
    kept_.pop_back();
  }
  bytes_ += added.jpeg.size();
  kept_.push_back(std::move(added));
  while (bytes_ > limit_) thin();
}

const RecallBuffer::Kept* RecallBuffer::find(int index) const {
  const auto found = std::lower_bound(kept_.begin(), kept_.end(), index,
                                      [](const Kept& kept, int wanted) { return kept.index < wanted; });
  return found == kept_.end() || found->index != index ? nullptr : &*found;
}

void RecallBuffer::thin() {
  stride_ *= 2;
  std::deque<Kept> fewer;
  for (Kept& kept : kept_) {
    if (fewer.empty() || fewer.back().index / stride_ != kept.index / stride_) {
      fewer.push_back(std::move(kept));
    } else if (kept.jpeg.size() > fewer.back().jpeg.size()) {
      fewer.back() = std::move(kept);
    }
  }
  kept_ = std::move(fewer);
  bytes_ = 0;
  for (const Kept& kept : kept_) bytes_ += kept.jpeg.size();
}

}  // namespace gyre
