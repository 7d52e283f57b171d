// SPDX-License-Identifier: Apache-2.0
// What makes a capture hard: things that really happen, to be switched on one by one.
#pragma once

namespace gyre::synthetic {

struct Trouble {
  bool white_half = false;    // walls and ceiling at x < 0 are plain white, and nothing stands there
  bool mirror = false;        // a wardrobe with mirrored doors, 3 m wide, along the wall at +x
  bool dark_clothes = false;  // sweater and trousers are black: hardly above the noise
  bool passer_by = false;     // somebody else walks along on the far side of the subject
  double arc_deg = 0.0;       // of the body's orbit: there on the upper ring, back on the lower; 0: two full turns
};

}  // namespace gyre::synthetic
