// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/tangents.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace gyre {

namespace {

struct Sum {
  Eigen::Vector3d along = Eigen::Vector3d::Zero();  // where u grows
  double turn = 0;                                  // sign of the texture's winding
};

Eigen::Vector3d across(const Eigen::Vector3d& v, const Eigen::Vector3d& normal) {
  return v - normal.dot(v) * normal;
}

Eigen::Vector4f tangent_of(const Sum& sum, const Eigen::Vector3d& normal) {
  Eigen::Vector3d along = across(sum.along, normal);
  if (along.norm() < 1e-9) along = across(Eigen::Vector3d::Unit(std::abs(normal.x()) < 0.6 ? 0 : 1), normal);
  Eigen::Vector4f tangent;
  tangent << along.normalized().cast<float>(), sum.turn < 0 ? -1.0F : 1.0F;
  return tangent;
}

}  // namespace

std::vector<std::array<Eigen::Vector4f, 3>> corner_tangents(const TriangleMesh& mesh,
                                                            const std::vector<Eigen::Vector3d>& normals) {
  std::map<std::pair<int, int>, Sum> sums;  // by vertex and texture coordinate
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3i& c = mesh.triangles[t];
    const Eigen::Vector3i& places = mesh.uv_triangles[t];
    const Eigen::Vector2d a = mesh.uv[places[1]] - mesh.uv[places[0]];
    const Eigen::Vector2d b = mesh.uv[places[2]] - mesh.uv[places[0]];
    const double area = a.x() * b.y() - a.y() * b.x();
    if (std::abs(area) < 1e-14) continue;
    const Eigen::Vector3d p = mesh.vertices[c[1]] - mesh.vertices[c[0]];
    const Eigen::Vector3d q = mesh.vertices[c[2]] - mesh.vertices[c[0]];
    const Eigen::Vector3d along = (b.y() * p - a.y() * q) / area;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d to = (mesh.vertices[c[(k + 1) % 3]] - mesh.vertices[c[k]]).normalized();
      const Eigen::Vector3d from = (mesh.vertices[c[(k + 2) % 3]] - mesh.vertices[c[k]]).normalized();
      const double angle = std::acos(std::clamp(to.dot(from), -1.0, 1.0));
      Sum& sum = sums[{c[k], places[k]}];
      sum.along += angle * across(along, normals[c[k]]).normalized();
      // v grows downwards, so a triangle that keeps its winding is left-handed in the picture.
      sum.turn += area < 0 ? angle : -angle;
    }
  }
  std::vector<std::array<Eigen::Vector4f, 3>> tangents(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int vertex = mesh.triangles[t][k];
      const auto found = sums.find({vertex, mesh.uv_triangles[t][k]});
      tangents[t][static_cast<std::size_t>(k)] =
          tangent_of(found == sums.end() ? Sum() : found->second, normals[vertex]);
    }
  }
  return tangents;
}

}  // namespace gyre
