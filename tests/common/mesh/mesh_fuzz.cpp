// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/mesh.h"
#include "common/mesh/mesh_io.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

// Any file is a mesh, a cloud or an error, and no triangle of a mesh names a vertex that is not there.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const gyre::MemoryFile file(data, size);
  for (const auto& mesh : {gyre::read_ply(file.path()), gyre::read_obj(file.path())}) {
    if (!mesh) continue;
    for (const Eigen::Vector3i& t : mesh->triangles) {
      if (t.minCoeff() < 0 || t.maxCoeff() >= static_cast<int>(mesh->vertices.size())) std::abort();
    }
  }
  if (const auto cloud = gyre::read_cloud(file.path())) {
    if (!cloud->normals.empty() && cloud->normals.size() != cloud->points.size()) std::abort();
  }
  return 0;
}
