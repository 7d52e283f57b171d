// SPDX-License-Identifier: Apache-2.0
// Memory for the numbers of every frame of a recording, taken before it begins.
#pragma once

#include <cstddef>
#include <vector>

namespace gyre {

// An empty vector with room for so many frames. Its memory has been written to, so that the process does not grow while
// it is filled; reserve() alone would leave that to the first use of each page.
template <class PerFrame>
std::vector<PerFrame> room_for(int frames) {
  std::vector<PerFrame> room(static_cast<std::size_t>(frames));
  room.clear();
  return room;
}

}  // namespace gyre
