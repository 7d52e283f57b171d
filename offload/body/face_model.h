// SPDX-License-Identifier: Apache-2.0
// The identity space of the ICT face model (ICT-FaceKit, MIT), as the template sources hold it.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace gyre {

struct FaceModel {
  TriangleMesh mesh;                    // mean face, head and neck: metres, +Y up, facing +Z
  std::vector<Eigen::Matrix3Xf> modes;  // offsets of one standard deviation, metres
  std::array<int, 68> landmarks{};      // vertices at the 68 points of iBUG (Sagonas et al. 2013), in its order
};

// Reads the first `modes` identity modes. An error names the file and what is wrong in it.
Result<FaceModel> read_face_model(const std::filesystem::path& folder, int modes);

}  // namespace gyre
