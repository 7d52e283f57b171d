// SPDX-License-Identifier: Apache-2.0
// Makes texels that come from elsewhere meet the photographed ones around them without a step.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/paint.h"

#include <cstdint>
#include <span>

namespace gyre {

// Poisson insertion (Perez, Gangnet and Blake, SIGGRAPH 2003) over the surface, charts' borders included: the inserted
// texels keep the differences between them and take an offset that leaves none to the photographed texels next to them.
// inserted: 1 a texel. reach: texels over which the offset fades; 0: it does not.
void insert_texels(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                   std::span<const std::uint8_t> inserted, double reach, int threads, Canvas& canvas);

}  // namespace gyre
