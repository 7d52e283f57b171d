// SPDX-License-Identifier: Apache-2.0
#include "offload/body/texture_file.h"

namespace gyre {

std::filesystem::path texture_file(const Bundle& bundle, std::string_view picture) {
  const std::filesystem::path stem = bundle.work("texture") / picture;
  std::filesystem::path jpeg = stem.string() + ".jpg";
  return std::filesystem::exists(jpeg) ? jpeg : std::filesystem::path(stem.string() + ".png");
}

std::string picture_type(const std::filesystem::path& file) {
  return file.extension() == ".jpg" ? "image/jpeg" : "image/png";
}

}  // namespace gyre
