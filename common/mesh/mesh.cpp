// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/mesh.h"

#include <Eigen/Geometry>

namespace gyre {

std::vector<Eigen::Vector3d> vertex_normals(const std::vector<Eigen::Vector3d>& vertices,
                                            const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<Eigen::Vector3d> normals(vertices.size(), Eigen::Vector3d::Zero());
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::Vector3d& a = vertices[t[0]];
    const Eigen::Vector3d n = (vertices[t[1]] - a).cross(vertices[t[2]] - a);  // length: twice the area
    for (int k = 0; k < 3; ++k) normals[t[k]] += n;
  }
  for (Eigen::Vector3d& n : normals) {
    const double length = n.norm();
    if (length > 0) n /= length;
  }
  return normals;
}

}  // namespace gyre
