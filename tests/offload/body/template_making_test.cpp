// SPDX-License-Identifier: Apache-2.0
// The steps that make a template: blending of targets, measures, principal components, joints, atlas space,
// subdivision.
#include "offload/body/atlas_space.h"
#include "offload/body/body_measures.h"
#include "offload/body/cage.h"
#include "offload/body/joint_regressor.h"
#include "offload/body/macro_shape.h"
#include "offload/body/shape_space.h"
#include "offload/body/template_tools.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

std::vector<Eigen::Vector3d> box_corners(const Eigen::Vector3d& half) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1 ? 1 : -1) * half.x(), (i & 2 ? 1 : -1) * half.y(), (i & 4 ? 1 : -1) * half.z());
  return corners;
}

const std::vector<std::vector<int>> box_quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                                 {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

TEST(MacroShape, WeightsOfEachCombinationSumToOne) {
  MacroShape shape;
  shape.gender = 0.3;
  shape.age = macro_age(40);
  shape.muscle = 0.8;
  shape.weight = 0.1;
  double universal = 0, ancestry = 0;
  for (const auto& [name, weight] : macro_targets(shape)) {
    if (name.starts_with("universal-")) universal += weight;
    for (const char* people : {"african-", "asian-", "caucasian-"})
      if (name.starts_with(people)) ancestry += weight;
  }
  EXPECT_NEAR(universal, 1, 1e-12);
  EXPECT_NEAR(ancestry, 1, 1e-12);
}

TEST(MacroShape, ExtremesPickOneTarget) {
  MacroShape shape;
  shape.gender = 1;
  shape.age = 0.5;
  shape.muscle = 1;
  shape.weight = 0;
  shape.height = 1;
  const auto targets = macro_targets(shape);
  const auto weight_of = [&](const std::string& wanted) {
    double sum = 0;
    for (const auto& [name, weight] : targets) sum += name == wanted ? weight : 0;
    return sum;
  };
  EXPECT_EQ(weight_of("universal-male-young-maxmuscle-minweight"), 1);
  EXPECT_EQ(weight_of("male-young-maxmuscle-minweight-maxheight"), 1);
  EXPECT_EQ(weight_of("universal-female-young-maxmuscle-minweight"), 0);
}

TEST(MacroShape, AgesOfMakeHuman) {
  EXPECT_DOUBLE_EQ(macro_age(25), 0.5);
  EXPECT_DOUBLE_EQ(macro_age(10), 0.1875);
  EXPECT_DOUBLE_EQ(macro_age(90), 1);
}

TEST(Measures, GirthIsTheTapeAroundTheHull) {
  const auto corners = box_corners({0.1, 1, 0.2});
  std::vector<Eigen::Vector3i> triangles;
  for (const auto& quad : box_quads) {
    triangles.emplace_back(quad[0], quad[1], quad[2]);
    triangles.emplace_back(quad[0], quad[2], quad[3]);
  }
  EXPECT_NEAR(girth(corners, triangles, 0.3), 1.2, 1e-12);
  EXPECT_EQ(girth(corners, triangles, 3), 0);
  EXPECT_NEAR(stature(corners, 8), 2, 1e-12);
}

TEST(ShapeSpace, FindsKnownComponentsInStandardDeviations) {
  // Two orthogonal directions with standard deviations 0.05 and 0.01.
  constexpr int vertices = 30, samples = 400;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd directions(3 * vertices, 2);
  for (Eigen::Index i = 0; i < directions.size(); ++i) directions(i) = normal(random);
  directions.col(0).normalize();
  directions.col(1) -= directions.col(0) * directions.col(0).dot(directions.col(1));
  directions.col(1).normalize();
  Eigen::MatrixXd amounts(samples, 2);
  for (int s = 0; s < samples; ++s) amounts.row(s) << 0.05 * normal(random), 0.01 * normal(random);
  const Eigen::MatrixXf rows = (amounts * directions.transpose()).cast<float>();
  const ShapeSpace space = principal_components(rows, Eigen::VectorXd::Ones(vertices), 2);
  for (int k = 0; k < 2; ++k) {
    const double sd = std::sqrt((amounts.col(k).array() - amounts.col(k).mean()).square().sum() / (samples - 1));
    EXPECT_NEAR(space.components.col(k).norm(), sd, 0.02 * sd);
    EXPECT_GT(std::abs(space.components.col(k).normalized().dot(directions.col(k))), 0.99);
  }
  EXPECT_NEAR(space.explained.sum(), 1, 1e-4);
}

TEST(JointRegressor, ReproducesAConvexCombination) {
  constexpr int vertices = 12, samples = 50;
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  Eigen::MatrixXf rows(samples, 3 * vertices);
  for (Eigen::Index i = 0; i < rows.size(); ++i) rows(i) = normal(random);
  Eigen::MatrixXd wanted(samples, 3);
  for (int axis = 0; axis < 3; ++axis)
    wanted.col(axis) = 0.75 * rows.col(3 * 4 + axis).cast<double>() + 0.25 * rows.col(3 * 7 + axis).cast<double>();
  std::vector<int> candidates(vertices);
  std::iota(candidates.begin(), candidates.end(), 0);
  const JointRegressor fitted = fit_regressor(rows, candidates, wanted);
  double sum = 0;
  for (const auto& [vertex, weight] : fitted.weights) {
    EXPECT_GT(weight, 0);
    sum += weight;
    EXPECT_NEAR(weight, vertex == 4 ? 0.75 : vertex == 7 ? 0.25 : 0.0, 0.01);
  }
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_LT(fitted.rms, 0.02);
}

TEST(AtlasSpace, FindsSpaceBesideWhatIsCovered) {
  AtlasSpace space(64, 1);
  const std::vector<Eigen::Vector2d> uv = {{0, 0}, {1, 0}, {1, 0.5}, {0, 0.5}};
  space.cover(uv, {{0, 1, 2}, {0, 2, 3}});
  const auto first = space.take({0.4, 0.4}), second = space.take({0.4, 0.4}), third = space.take({0.4, 0.4});
  ASSERT_TRUE(first && second);
  EXPECT_GT(first->y(), 0.5);
  EXPECT_GT((*first - *second).cwiseAbs().maxCoeff(), 0.4);
  EXPECT_FALSE(third);
}

TEST(Cage, SubdivisionOfABoxIsClosedAndSymmetric) {
  std::vector<CageFace> faces;
  for (const auto& quad : box_quads) faces.push_back({quad, std::vector<Eigen::Vector2d>(4, Eigen::Vector2d::Zero())});
  const SubdividedCage fine = subdivide(8, faces, 2);
  EXPECT_EQ(fine.weights.rows(), 98);
  EXPECT_EQ(fine.faces.size(), 96U);
  const Eigen::VectorXd sums = fine.weights * Eigen::VectorXd::Ones(8);
  EXPECT_LT((sums.array() - 1).abs().maxCoeff(), 1e-12);
  Eigen::MatrixXd wanted(8, 3);
  const auto corners = box_corners({1, 1, 1});
  for (int i = 0; i < 8; ++i) wanted.row(i) = corners[i];
  const Eigen::MatrixXd refined = fine.weights * cage_through(wanted, fine);
  EXPECT_LT((refined.topRows(8) - wanted).cwiseAbs().maxCoeff(), 2e-2);
}

TEST(Tools, StrongestJointsSumToOne) {
  Eigen::VectorXd weights(6);
  weights << 0.1, 0.3, 0, 0.2, 0.15, 0.25;
  const SkinWeights skin = strongest_joints(weights);
  EXPECT_EQ(skin.joint[0], 1);
  EXPECT_EQ(skin.weight[0] + skin.weight[1] + skin.weight[2] + skin.weight[3], 1.0F);
  EXPECT_NEAR(skin.weight[0], 0.3 / 0.9, 1e-6);
}

TEST(Tools, MirrorByPosition) {
  const std::vector<Eigen::Vector3d> vertices = {{1, 2, 3}, {-1, 2, 3}, {0, 1, 1}, {0.5, 0, 0}};
  EXPECT_EQ(mirror_by_position(vertices, 1e-6), (std::vector<int>{1, 0, 2, -1}));
}

}  // namespace
}  // namespace gyre
