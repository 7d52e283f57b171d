// SPDX-License-Identifier: Apache-2.0
// Identities of the deformation energy: what must cost nothing, what must not move, what must move along.
#include "offload/fit/edge_laplacian.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace gyre {
namespace {

struct Sheet {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
};

// n x n vertices over [-0.5, 0.5]^2, at height bump * x * y * (1 + x).
Sheet make_sheet(int n, double bump) {
  Sheet sheet;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double x = static_cast<double>(i) / (n - 1) - 0.5, y = static_cast<double>(k) / (n - 1) - 0.5;
      sheet.vertices.emplace_back(x, y, bump * x * y * (1 + x));
    }
  for (int i = 0; i + 1 < n; ++i)
    for (int k = 0; k + 1 < n; ++k) {
      const int a = i * n + k, b = a + n, c = b + 1, d = a + 1;
      sheet.triangles.emplace_back(a, b, c);
      sheet.triangles.emplace_back(a, c, d);
    }
  return sheet;
}

std::vector<Eigen::Vector3d> transformed(const std::vector<Eigen::Vector3d>& points, const Eigen::Affine3d& motion) {
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& p : points) moved.emplace_back(motion * p);
  return moved;
}

// Vertices that are pulled somewhere.
struct Pins {
  std::vector<double> weights;
  std::vector<Eigen::Vector3d> targets;

  explicit Pins(std::size_t count) : weights(count, 0.0), targets(count, Eigen::Vector3d::Zero()) {}
  void add(int vertex, const Eigen::Vector3d& target) {
    weights[vertex] = 1.0;
    targets[vertex] = target;
  }
};

double largest_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

const Eigen::Affine3d rigid =
    Eigen::Translation3d(0.3, -1.0, 2.0) * Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized());

TEST(EdgeLaplacian, RigidMotionCostsNothing) {
  const Sheet sheet = make_sheet(9, 0.8);
  for (const double membrane : {0.0, 0.5}) {
    EdgeLaplacian energy(sheet.vertices, sheet.triangles, membrane);
    const auto moved = transformed(sheet.vertices, rigid);
    energy.fit_rotations(moved, 1);
    EXPECT_LT(energy.energy(moved), 1e-24);
  }
}

TEST(EdgeLaplacian, BendingCostsSomething) {
  const Sheet flat = make_sheet(9, 0.0), bent = make_sheet(9, 0.8);
  EdgeLaplacian energy(flat.vertices, flat.triangles);
  energy.fit_rotations(bent.vertices, 1);
  EXPECT_GT(energy.energy(bent.vertices), 1e-7);
}

TEST(EdgeLaplacian, LinearMapsOfAFlatSheetCostNothingWithoutMembrane) {
  const Sheet flat = make_sheet(9, 0.0);
  Eigen::Affine3d stretch = Eigen::Affine3d::Identity();
  stretch.linear() << 1.7, 0.3, 0, -0.2, 0.8, 0, 0, 0, 1;
  const auto stretched = transformed(flat.vertices, stretch);
  EdgeLaplacian bending(flat.vertices, flat.triangles, 0.0), with_membrane(flat.vertices, flat.triangles, 0.1);
  bending.fit_rotations(stretched, 1);
  with_membrane.fit_rotations(stretched, 1);
  EXPECT_LT(bending.energy(stretched), 1e-24);
  EXPECT_GT(with_membrane.energy(stretched), 1e-6);
}

TEST(EdgeLaplacian, TargetsAtTheSurfaceMoveNothing) {
  const Sheet sheet = make_sheet(9, 0.8);
  EdgeLaplacian energy(sheet.vertices, sheet.triangles, 0.01);
  Pins pins(sheet.vertices.size());
  for (const int v : {0, 17, 40, 44, 80}) pins.add(v, sheet.vertices[v]);
  energy.fit_rotations(sheet.vertices, 1);
  ASSERT_TRUE(energy.factorise(pins.weights, 1.0));
  EXPECT_LT(largest_distance(energy.solve(pins.targets, sheet.vertices), sheet.vertices), 1e-6);
}

TEST(EdgeLaplacian, NoTargetsMoveNothing) {
  const Sheet sheet = make_sheet(5, 0.8);
  EdgeLaplacian energy(sheet.vertices, sheet.triangles, 0.1);
  const Pins none(sheet.vertices.size());
  ASSERT_TRUE(energy.factorise(none.weights, 1.0));
  EXPECT_LT(largest_distance(energy.solve(none.targets, sheet.vertices), sheet.vertices), 1e-6);
}

TEST(EdgeLaplacian, AFewHandlesCarryTheWholeSheetRigidly) {
  const Sheet sheet = make_sheet(9, 0.8);
  EdgeLaplacian energy(sheet.vertices, sheet.triangles, 0.1);
  const auto target = transformed(sheet.vertices, rigid);
  Pins pins(sheet.vertices.size());
  for (const int v : {0, 8, 40, 72, 80}) pins.add(v, target[v]);
  ASSERT_TRUE(energy.factorise(pins.weights, 1.0));
  std::vector<Eigen::Vector3d> x = sheet.vertices;
  for (int turn = 0; turn < 400; ++turn) {
    energy.fit_rotations(x, 1);
    x = energy.solve(pins.targets, x);
  }
  EXPECT_LT(largest_distance(x, target), 1e-3);
}

TEST(EdgeLaplacian, SolutionFollowsASimilarityOfEverything) {
  const Sheet sheet = make_sheet(9, 0.8);
  const Eigen::Affine3d similarity = rigid * Eigen::Scaling(2.5);
  const auto solve = [&](const Eigen::Affine3d& motion) {
    const auto reference = transformed(sheet.vertices, motion);
    const double size = std::cbrt(motion.linear().determinant());
    EdgeLaplacian energy(reference, sheet.triangles, 0.05 * size);
    Pins pins(reference.size());
    for (const int v : {0, 8, 40, 72, 80})
      pins.add(v, motion * (sheet.vertices[v] + Eigen::Vector3d(0, 0, v == 40 ? 0.2 : 0.0)));
    energy.fit_rotations(reference, 1);
    EXPECT_TRUE(energy.factorise(pins.weights, 0.01));
    return energy.solve(pins.targets, reference);
  };
  EXPECT_LT(largest_distance(solve(similarity), transformed(solve(Eigen::Affine3d::Identity()), similarity)), 1e-5);
}

TEST(EdgeLaplacian, AKeptFactorisationSolvesLikeAFreshOne) {
  const Sheet sheet = make_sheet(9, 0.8);
  const auto moved = transformed(sheet.vertices, rigid);
  EdgeLaplacian kept(sheet.vertices, sheet.triangles, 0.1);
  Pins pins(sheet.vertices.size());
  for (const int v : {0, 8, 72}) pins.add(v, sheet.vertices[v]);
  ASSERT_TRUE(kept.factorise(pins.weights, 0.5));
  kept.solve(pins.targets, sheet.vertices);
  for (const int v : {0, 8, 72}) pins.add(v, moved[v]);
  kept.fit_rotations(moved, 1);
  EdgeLaplacian fresh(sheet.vertices, sheet.triangles, 0.1);
  fresh.fit_rotations(moved, 1);
  ASSERT_TRUE(fresh.factorise(pins.weights, 0.5));
  EXPECT_LT(largest_distance(kept.solve(pins.targets, moved), fresh.solve(pins.targets, moved)), 1e-12);
}

TEST(EdgeLaplacian, ThreadsDoNotChangeTheResult) {
  const Sheet sheet = make_sheet(30, 0.8);
  const auto moved = transformed(sheet.vertices, rigid);
  const auto solve = [&](int threads) {
    EdgeLaplacian energy(sheet.vertices, sheet.triangles, 0.1);
    energy.fit_rotations(moved, threads);
    Pins pins(moved.size());
    for (const int v : {3, 500}) pins.add(v, moved[v]);
    EXPECT_TRUE(energy.factorise(pins.weights, 1.0));
    return energy.solve(pins.targets, moved);
  };
  EXPECT_EQ(largest_distance(solve(1), solve(3)), 0.0);
}

}  // namespace
}  // namespace gyre
