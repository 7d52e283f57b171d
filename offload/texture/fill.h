// SPDX-License-Identifier: Apache-2.0
// Colours for what no photograph saw.
#pragma once

#include "offload/texture/atlas.h"
#include "offload/texture/paint.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// Texels of the surface without a colour get one by harmonic interpolation over the surface: seen texels give their
// vertices a mean colour, the other vertices solve the graph Laplace equation with these as boundary values (a part
// that was not seen at all takes the mean colour), and texels interpolate their corners. Never crosses from chart to
// chart in the picture. skip: triangles that keep out of it (1), one a triangle.
void fill_surface(const Atlas& atlas, std::span<const Eigen::Vector3i> triangles, std::size_t vertices,
                  std::span<const std::uint8_t> skip, Canvas& canvas);

// Texels without surface get a colour from the nearest ones with, by push-pull over an image pyramid (Gortler et al.,
// The Lumigraph, SIGGRAPH 1996, section 3.4), so that no mipmap level mixes in a foreign colour.
void fill_background(int size, Canvas& canvas);

}  // namespace gyre
