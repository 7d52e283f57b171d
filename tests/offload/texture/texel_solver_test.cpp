// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/texel_solver.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <set>

namespace gyre {
namespace {

// A box of six charts in a texture of 48 x 48.
class BoxTexels : public testing::Test {
 protected:
  BoxTexels() {
    scene::add_box(mesh_, {0, 0, 0}, {0.2, 0.3, 0.15}, 3, {0, 0}, 1.0);
    atlas_ = map_atlas(mesh_.uv, mesh_.uv_triangles, 48, 1);
    graph_ = connect_texels(mesh_, atlas_, shared_edges(mesh_.triangles), std::vector<std::uint8_t>(48 * 48, 1));
  }

  // Side of the box a node belongs to.
  int side_of(std::int32_t node) const { return atlas_.triangle[graph_.texel[node]] / 18; }

  TriangleMesh mesh_;
  Atlas atlas_;
  TexelGraph graph_;
};

TEST_F(BoxTexels, NeighboursKeepToTheirChartAndLinksJoinAllTwelveEdges) {
  std::set<std::pair<int, int>> joined;
  for (std::size_t n = 0; n < graph_.texel.size(); ++n) {
    for (int side = 0; side < 4; ++side) {
      const std::int32_t m = graph_.neighbour[n][side];
      if (m < 0) continue;
      EXPECT_EQ(side_of(static_cast<std::int32_t>(n)), side_of(m));
      EXPECT_EQ(graph_.neighbour[m][opposite_side(side)], static_cast<std::int32_t>(n));
    }
  }
  for (const auto& [a, b] : graph_.links) {
    EXPECT_NE(side_of(a), side_of(b));
    joined.insert(std::minmax(side_of(a), side_of(b)));
    const double apart =
        (texel_point(mesh_, atlas_, graph_.texel[a]) - texel_point(mesh_, atlas_, graph_.texel[b])).norm();
    EXPECT_LT(apart, 0.08);  // a texel is 0.03 m long at most
  }
  EXPECT_EQ(joined.size(), 12U);
}

TEST_F(BoxTexels, SolutionIsThatOfDenseCholesky) {
  const auto nodes = static_cast<Eigen::Index>(graph_.texel.size());
  std::vector<float> diagonal(graph_.texel.size());
  std::vector<Eigen::Vector3f> right(graph_.texel.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(nodes, nodes);
  Eigen::MatrixX3d b(nodes, 3);
  const auto couple = [&](Eigen::Index n, Eigen::Index m) {
    matrix(n, n) += 1.0;
    matrix(n, m) -= 1.0;
  };
  for (Eigen::Index n = 0; n < nodes; ++n) {
    diagonal[n] = n % 7 == 0 ? 0.5F : 0.001F;
    right[n] = {static_cast<float>(std::sin(0.3 * static_cast<double>(n))), n % 2 == 0 ? 1.0F : -1.0F, 0.0F};
    b.row(n) = right[n].transpose().cast<double>();
    matrix(n, n) += double{diagonal[n]};
    for (const std::int32_t m : graph_.neighbour[n]) {
      if (m >= 0) couple(n, m);
    }
  }
  for (const auto& [n, m] : graph_.links) {
    couple(n, m);
    couple(m, n);
  }
  ASSERT_TRUE(matrix.isApprox(matrix.transpose()));
  const Eigen::MatrixX3d truth = matrix.ldlt().solve(b);
  const auto one = solve_on_texels(mesh_, atlas_, graph_, diagonal, right, 1e-6, 1);
  const auto three = solve_on_texels(mesh_, atlas_, graph_, diagonal, right, 1e-6, 3);
  for (Eigen::Index n = 0; n < nodes; ++n) {
    EXPECT_LT((one[n].cast<double>() - truth.row(n).transpose()).norm(), 1e-3);
    EXPECT_EQ(one[n], three[n]);
  }
}

TEST_F(BoxTexels, NoNodesGiveNothing) {
  const TexelGraph none =
      connect_texels(mesh_, atlas_, shared_edges(mesh_.triangles), std::vector<std::uint8_t>(48 * 48, 0));
  EXPECT_TRUE(none.links.empty());
  EXPECT_TRUE(solve_on_texels(mesh_, atlas_, none, {}, {}, 1e-3, 2).empty());
}

}  // namespace
}  // namespace gyre
