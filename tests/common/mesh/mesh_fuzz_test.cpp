// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(MeshFuzz, MutatedFilesNeverCrash) {
  const std::string header =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
      "property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string ascii = "ply\nformat ascii 1.0\n" + header + face +
                            "end_header\n0 0 0 0 0 1 1 2 3\n1 0 0 0 0 1 1 2 3\n0 1 0 0 0 1 1 2 3\n3 0 1 2\n";
  const std::string binary = "ply\nformat binary_little_endian 1.0\n" + header + face + "end_header\n" +
                             std::string(3 * 27, '\1') + std::string("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13);
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf -3 -2 -1\n";
  fuzz({"", ascii, binary, obj, "ply\nformat ascii 1.0\nelement vertex 999999999999\n"}, 10'000);
}

}  // namespace
}  // namespace gyre
