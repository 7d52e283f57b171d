// SPDX-License-Identifier: Apache-2.0
// Where a JPEG ends in what a camera gives: buffers are longer than pictures.
#pragma once

#include <string_view>

namespace gyre {

// The picture at the beginning of `bytes`, from its first marker to the end of its image (ITU-T T.81, Annex B), without
// what follows: padding, or what an earlier picture left in the buffer. A thumbnail inside is part of it. Empty when no
// picture begins there or it does not end.
std::string_view jpeg_extent(std::string_view bytes);

}  // namespace gyre
