// SPDX-License-Identifier: Apache-2.0
// How much of the circle around the subject the cameras stand on.
#pragma once

#include "offload/cameras/scene.h"

namespace gyre {

struct RingOptions {
  double reach = 30 * 0.017453292519943295;  // between neighbouring cameras; farther apart they see too little together
  int min_links = 20;                        // points seen from both sides of a place on the ring
  double close_up = 0.5;                     // cameras nearer than this share of the far ones' distance do not count
};

struct Ring {
  bool closed = false;       // cameras all around, each linked with the next
  double covered = 0.0;      // of the circle, radians in [0, 2 pi]
  double largest_gap = 0.0;  // between the azimuths of neighbouring cameras, radians
};

// From the azimuths of the registered views around the y axis, in a scene that has been moved to the world (up +y, the
// axis through the subject). The circle is covered between neighbours no farther apart than `reach` where enough points
// are seen from both sides. Close-ups, as of a head, leave most of the person out of the picture and do not count.
// Fewer than three views cover nothing.
Ring find_ring(const Scene& scene, const RingOptions& options = {});

}  // namespace gyre
