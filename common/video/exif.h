// SPDX-License-Identifier: Apache-2.0
// What Gyre takes from the EXIF block of a stored JPEG or PNG: how it must be turned to stand upright, and its lens.
#pragma once

#include "common/geometry/camera.h"

#include <cstddef>
#include <optional>
#include <span>

namespace gyre {

struct ExifFacts {
  Orientation orientation = Orientation::upright;
  std::optional<double> focal_35mm;  // focal length of the lens that has this field of view on 36 mm x 24 mm film, mm
};

// The tags Orientation (0x0112 of IFD0) and FocalLengthIn35mmFilm (0xA405 of the Exif IFD; CIPA DC-008 sections 4.6.5
// and 4.6.6) of the EXIF block of a JPEG (APP1 segment) or PNG (eXIf chunk). A fact is left at its default when there
// is no such block or tag, when its value is impossible (an orientation that is not 1 to 8, a focal length of 0, which
// stands for unknown), or when the bytes are damaged: whether the picture itself can be read is the decoder's to say.
// Never reads outside `file`.
ExifFacts read_exif(std::span<const std::byte> file);

}  // namespace gyre
