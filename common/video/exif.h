// SPDX-License-Identifier: Apache-2.0
// The one EXIF tag Gyre obeys: how a stored JPEG or PNG must be turned to stand upright.
#pragma once

#include "common/geometry/camera.h"

#include <cstddef>
#include <span>

namespace gyre {

// Orientation tag (0x0112 of IFD0, CIPA DC-008 section 4.6.5) of the EXIF block of a JPEG (APP1 segment) or PNG (eXIf
// chunk). Upright when there is no such block or tag, when its value is not 1 to 8, or when the bytes are damaged:
// whether the picture itself can be read is the decoder's to say. Never reads outside `file`.
Orientation exif_orientation(std::span<const std::byte> file);

}  // namespace gyre
