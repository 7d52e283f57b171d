// SPDX-License-Identifier: Apache-2.0
// Pictures of a folder as frames; open_capture is the way in.
#pragma once

#include "common/video/frame_source.h"

#include <string_view>

namespace gyre {

Result<std::unique_ptr<FrameSource>> open_image_folder(const std::filesystem::path& folder);

// Order of names in which runs of digits compare as numbers; names that then are equal compare byte by byte.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace gyre
