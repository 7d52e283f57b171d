// SPDX-License-Identifier: Apache-2.0
// The same avatar with fewer triangles.
#pragma once

#include "offload/avatar/avatar.h"

namespace gyre {

// Collapses edges onto one of their ends in the order of the quadric error (Garland and Heckbert, "Surface
// Simplification Using Quadric Error Metrics", 1997) until `share` (0 ... 1) of the triangles are left, or no more can
// go. Every vertex that stays is one of the avatar's, with its place, skin, texture coordinates and expressions; those
// at texture seams and other borders all stay, so that no seam opens, and what expressions move most goes last. Error
// when the share is not within 0 ... 1.
Result<Avatar> reduced(const Avatar& avatar, double share);

}  // namespace gyre
