// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/tangents.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A square in the plane z = 0, seen from +z. Its picture is upright; mirrored when `mirrored`.
TriangleMesh square(bool mirrored) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  if (mirrored)
    for (Eigen::Vector2d& uv : mesh.uv) uv.x() = 1 - uv.x();
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

TEST(CornerTangents, LeadWhereUGrowsAndUpInThePicture) {
  for (const bool mirrored : {false, true}) {
    const TriangleMesh mesh = square(mirrored);
    const auto normals = vertex_normals(mesh.vertices, mesh.triangles);
    for (const auto& triangle : corner_tangents(mesh, normals)) {
      for (const Eigen::Vector4f& tangent : triangle) {
        EXPECT_LT((tangent.head<3>() - Eigen::Vector3f(mirrored ? -1 : 1, 0, 0)).norm(), 1e-6F);
        const Eigen::Vector3f up = tangent[3] * Eigen::Vector3f::UnitZ().cross(tangent.head<3>());
        EXPECT_LT((up - Eigen::Vector3f::UnitY()).norm(), 1e-6F);
      }
    }
  }
}

TEST(CornerTangents, AreUnitAcrossTheNormalEvenWithoutAreaInThePicture) {
  TriangleMesh mesh = square(false);
  for (Eigen::Vector2d& uv : mesh.uv) uv = {0.5, 0.5};
  const std::vector<Eigen::Vector3d> normals(4, Eigen::Vector3d(0.6, 0, 0.8));
  for (const auto& triangle : corner_tangents(mesh, normals)) {
    for (const Eigen::Vector4f& tangent : triangle) {
      EXPECT_NEAR(tangent.head<3>().norm(), 1, 1e-6);
      EXPECT_NEAR(tangent.head<3>().cast<double>().dot(normals[0]), 0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace gyre
