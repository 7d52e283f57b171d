// SPDX-License-Identifier: Apache-2.0
// What no photograph saw of one side of the body, from what they saw of the other.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/paint.h"

#include <span>

namespace gyre {

// Texels of the surface without a colour take that of their mirror image where photographs gave it one, by Poisson
// insertion: differences between texels are the mirror image's, and none to the seen texels around. mirror: vertex to
// its mirror vertex, -1: none. skip: triangles that keep out of it (1). Call after blending.
void fill_mirrored(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                   std::span<const int> mirror, std::span<const std::uint8_t> skip, int threads, Canvas& canvas);

}  // namespace gyre
