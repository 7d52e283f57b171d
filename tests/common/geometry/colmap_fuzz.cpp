// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/colmap_model.h"
#include "tests/fuzz/fuzz.h"

#include <unistd.h>
#include <cstdlib>
#include <fstream>

// Any three texts, divided by zero bytes, are a model or an error; every observation of a model names a point of it.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "colmap-fuzz-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    return std::filesystem::path(name);
  }();
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    const std::size_t end = std::min(rest.find('\0'), rest.size());
    std::ofstream(folder / name, std::ios::binary) << rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (const auto model = gyre::read_colmap_model(folder)) {
    for (const auto& [id, image] : model->images)
      if (!model->cameras.contains(image.camera_id)) std::abort();
  }
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  return 0;
}
