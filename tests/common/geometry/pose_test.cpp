// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/pose.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

std::vector<Eigen::Vector3d> random_points(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points(n);
  for (Eigen::Vector3d& p : points) p = {normal(random), normal(random), normal(random)};
  return points;
}

Similarity some_similarity() {
  return {2.5, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized())), {0.3, -4, 5}};
}

TEST(Pose, InverseUndoes) {
  const Pose a_from_b{some_similarity().rotation, {1, 2, 3}};
  const Eigen::Vector3d x(0.1, -7, 2);
  EXPECT_TRUE((a_from_b.inverse() * (a_from_b * x)).isApprox(x, 1e-12));
  EXPECT_TRUE(((a_from_b * a_from_b.inverse()).matrix()).isIdentity(1e-12));
}

TEST(RotationAbout, TurnsByItsLengthAboutItself) {
  const Eigen::Vector3d w = 0.7 * Eigen::Vector3d(1, -2, 0.5).normalized();
  EXPECT_TRUE(rotation_about(w).isApprox(Eigen::Quaterniond(Eigen::AngleAxisd(0.7, w.normalized())), 1e-14));
  EXPECT_TRUE((rotation_about(w) * rotation_about(-w)).isApprox(Eigen::Quaterniond::Identity(), 1e-14));
  // Where an angle cannot be told from none, it is still a rotation of that size.
  const Eigen::Vector3d tiny(1e-12, 0, -2e-12), x(3, 4, 5);
  EXPECT_NEAR((rotation_about(tiny) * x - x - tiny.cross(x)).norm(), 0.0, 1e-14);
  EXPECT_TRUE(rotation_about(Eigen::Vector3d::Zero()).isApprox(Eigen::Quaterniond::Identity()));
}

TEST(Similarity, AlignmentRecoversTheExactTransform) {
  const Similarity truth = some_similarity();
  const std::vector<Eigen::Vector3d> b = random_points(20, 1);
  std::vector<Eigen::Vector3d> a;
  for (const Eigen::Vector3d& p : b) a.push_back(truth * p);
  const Result<Similarity> found = align_points(a, b);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->matrix().isApprox(truth.matrix(), 1e-10));
  EXPECT_TRUE((found->inverse() * (truth * b[3])).isApprox(b[3], 1e-10));
}

TEST(Similarity, RigidAlignmentOfAMirrorImageIsStillARotation) {
  const std::vector<Eigen::Vector3d> b = random_points(20, 2);
  std::vector<Eigen::Vector3d> a;
  for (const Eigen::Vector3d& p : b) a.emplace_back(-p.x(), p.y(), p.z());
  const Result<Similarity> found = align_points(a, b, false);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
  EXPECT_EQ(found->scale, 1.0);
}

TEST(Similarity, PointsOnALineCannotBeAligned) {
  const std::vector<Eigen::Vector3d> line = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  EXPECT_FALSE(align_points(line, line));
  EXPECT_FALSE(align_points(std::span(line).first(2), std::span(line).first(2)));
}

TEST(Similarity, MovingTheWorldKeepsThePicture) {
  const Similarity b_from_a = some_similarity();
  const Pose cam_from_a{Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY())), {0.2, 0.1, 4}};
  const Pose cam_from_b = cam_from_moved_world(cam_from_a, b_from_a);
  const Eigen::Vector3d x(0.3, 0.5, -0.2);
  const Eigen::Vector3d before = cam_from_a * x;
  const Eigen::Vector3d after = cam_from_b * (b_from_a * x);
  EXPECT_TRUE((after / after.z()).isApprox(before / before.z(), 1e-12));
  EXPECT_TRUE(centre_of(cam_from_b).isApprox(b_from_a * centre_of(cam_from_a), 1e-12));
}

}  // namespace
}  // namespace gyre
