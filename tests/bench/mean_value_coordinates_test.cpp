// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/mean_value_coordinates.h"

#include "offload/body/template.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using Points = std::vector<Eigen::Vector3d>;

struct Box {
  Points vertices;
  std::vector<Eigen::Vector3i> triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  Box() {
    for (int i = 0; i < 8; ++i) vertices.emplace_back(i & 1, i & 2 ? 1 : 0, i & 4 ? 1 : 0);
  }
};

Eigen::Vector3d combined(const Points& vertices, const Eigen::VectorXd& weights) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < vertices.size(); ++v) sum += weights[static_cast<Eigen::Index>(v)] * vertices[v];
  return sum;
}

TEST(MeanValueCoordinates, SumToOneAndGiveThePointBack) {
  const BodyTemplate body = built_in_template();
  for (const Eigen::Vector3d& p : joint_positions(body, body.mesh.vertices)) {
    const Eigen::VectorXd w = mean_value_coordinates(body.mesh.vertices, body.mesh.triangles, p);
    EXPECT_NEAR(w.sum(), 1.0, 1e-12);
    EXPECT_LT((combined(body.mesh.vertices, w) - p).norm(), 1e-9);
  }
}

TEST(MeanValueCoordinates, FollowLinearMotions) {
  const Box box;
  const Eigen::Vector3d p(0.2, 0.7, 0.4);
  Eigen::Matrix3d m;
  m << 1, 0.2, 0, 0.1, 0.9, 0.3, 0, -0.4, 1.2;
  const Eigen::Vector3d shift(1, 2, 3);
  Points moved;
  for (const Eigen::Vector3d& v : box.vertices) moved.emplace_back(m * v + shift);
  const Eigen::VectorXd w = mean_value_coordinates(box.vertices, box.triangles, p);
  EXPECT_LT((combined(moved, w) - (m * p + shift)).norm(), 1e-12);
  EXPECT_GT(w.minCoeff(), 0.0);  // convex
}

TEST(MeanValueCoordinates, AreBarycentricOnFacesEdgesAndVertices) {
  const Box box;
  const auto weights_at = [&](const Eigen::Vector3d& p) {
    return mean_value_coordinates(box.vertices, box.triangles, p);
  };
  const Eigen::VectorXd on_vertex = weights_at(box.vertices[5]);
  EXPECT_EQ(on_vertex[5], 1.0);
  EXPECT_EQ(on_vertex.cwiseAbs().sum(), 1.0);
  const Eigen::VectorXd on_edge = weights_at({0.25, 0, 0});
  EXPECT_NEAR(on_edge[0], 0.75, 1e-9);
  EXPECT_NEAR(on_edge[1], 0.25, 1e-9);
  const Eigen::VectorXd on_face = weights_at({0.5, 0.25, 0});  // in the triangle of vertices 0, 2, 1
  EXPECT_NEAR(on_face[0], 0.25, 1e-9);
  EXPECT_NEAR(on_face[1], 0.5, 1e-9);
  EXPECT_NEAR(on_face[2], 0.25, 1e-9);
  EXPECT_NEAR(on_face.tail(5).norm(), 0.0, 1e-12);
}

TEST(MeanValueCoordinates, AreContinuousAtTheSurface) {
  const Box box;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.5, 0.25, 0), Eigen::Vector3d(0.25, 0, 0), Eigen::Vector3d(1, 0, 1)}) {
    const Eigen::Vector3d inside = p + 1e-3 * (Eigen::Vector3d(0.5, 0.5, 0.5) - p);
    const Eigen::VectorXd on = mean_value_coordinates(box.vertices, box.triangles, p);
    const Eigen::VectorXd near = mean_value_coordinates(box.vertices, box.triangles, inside);
    EXPECT_LT((on - near).norm(), 0.02);
    EXPECT_LT((combined(box.vertices, near) - inside).norm(), 1e-8);
  }
}

TEST(MeanValueCoordinates, ExistOutsideToo) {
  const Box box;
  const Eigen::Vector3d p(2, -1, 0.5);
  const Eigen::VectorXd w = mean_value_coordinates(box.vertices, box.triangles, p);
  EXPECT_NEAR(w.sum(), 1.0, 1e-9);
  EXPECT_LT((combined(box.vertices, w) - p).norm(), 1e-9);
}

}  // namespace
}  // namespace gyre
