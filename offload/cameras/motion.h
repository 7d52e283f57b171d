// SPDX-License-Identifier: Apache-2.0
// How a pass was taken: what moves, the camera or the subject.
#pragma once

namespace gyre {

enum class Motion {
  orbit,  // all that is seen moves as one: the camera walks around, or the subject turns before a plain background
  turn,   // the camera is fixed, and the subject turns before a background that can be told from it
};

}  // namespace gyre
