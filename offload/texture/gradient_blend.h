// SPDX-License-Identifier: Apache-2.0
// Makes patches of different photographs meet without a step, by their gradients.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/paint.h"

#include <span>

namespace gyre {

struct GradientOptions {
  double reach = 1.0 / 16.0;  // of the texture's side: how far the offset that removes a step fades out
};

// Poisson blending (Perez, Gangnet and Blake, SIGGRAPH 2003) on the surface instead of in the picture, as Prada et al.
// (SIGGRAPH 2018): the texels of photographs get the colours whose differences between neighbours, charts' borders
// included, are nearest to the photographs', with a slight pull to the painted colours (Bhat et al., ECCV 2008). Inside
// a patch the difference wanted is the painted one, between two patches the mean of both photographs'. Where only one
// sees both texels it is that one's, and where neither does the two are independent.
// Solved for the offset from the painted colours, which is smooth away from borders.
void blend_gradients(const PaintJob& job, std::span<const SharedEdge> edges, const GradientOptions& options,
                     int threads, Canvas& canvas);

}  // namespace gyre
