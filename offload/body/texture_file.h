// SPDX-License-Identifier: Apache-2.0
// The pictures of a texture on disk, as the stage `texture` leaves them and later stages take them.
#pragma once

#include "common/bundle/bundle.h"

#include <filesystem>
#include <string>
#include <string_view>

namespace gyre {

// `picture` ("albedo") in work/texture, as JPEG when there is one, else as PNG whether it is there or not.
std::filesystem::path texture_file(const Bundle& bundle, std::string_view picture);

// "image/jpeg" for a name that ends in .jpg, else "image/png".
std::string picture_type(const std::filesystem::path& file);

}  // namespace gyre
