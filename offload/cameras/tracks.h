// SPDX-License-Identifier: Apache-2.0
// Tracks: the transitive closure of pairwise matches, without contradictions.
#pragma once

#include "offload/cameras/scene.h"

#include <span>

namespace gyre {

// Replaces the scene's tracks by those of `pairs`. Matches are joined from the pair with most matches to the one with
// fewest; a match that would put two keypoints of one view into a track is left out, so that a false match costs one
// link and not the track. No track is triangulated afterwards.
void build_tracks(Scene& scene, std::span<const ViewPair> pairs);

}  // namespace gyre
