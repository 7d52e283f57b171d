// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

// Any file is a template or an error; a template's indices stay inside it.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const gyre::MemoryFile file(data, size);
  const auto body = gyre::read_template(file.path());
  if (!body) return 0;
  const auto vertices = static_cast<int>(body->mesh.vertices.size());
  for (const Eigen::Vector3i& t : body->mesh.triangles)
    if (t.minCoeff() < 0 || t.maxCoeff() >= vertices) std::abort();
  return 0;
}
