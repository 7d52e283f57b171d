// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/cloud_alignment.h"

#include "tests/offload/cameras/bust.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

std::vector<Eigen::Vector3d> noisy(const std::vector<SurfacePoint>& points, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> noise(0.0, 0.002);
  std::vector<Eigen::Vector3d> result;
  for (const SurfacePoint& p : points)
    result.push_back(p.position + Eigen::Vector3d(noise(engine), noise(engine), noise(engine)));
  return result;
}

std::vector<Eigen::Vector3d> moved(std::vector<Eigen::Vector3d> points, const Similarity& by) {
  for (Eigen::Vector3d& p : points) p = by * p;
  return points;
}

TEST(CloudAlignment, finds_scale_heading_and_place_without_common_points) {
  const std::vector<Eigen::Vector3d> body = noisy(sample_bust(700, 0.0, 1), 2);
  for (int turn = 0; turn < 6; ++turn) {
    Similarity truth;  // b_from_a
    truth.scale = 0.6 + 0.3 * turn;
    truth.rotation = Eigen::AngleAxisd(2 * degree, Eigen::Vector3d::UnitX()) *
                     Eigen::AngleAxisd((61 * turn + 5) * degree, Eigen::Vector3d::UnitY());
    truth.translation = {0.3, -2.0, 0.1 * turn};
    const std::vector<Eigen::Vector3d> head = moved(noisy(sample_bust(1500, 1.25, 3), 4), truth);
    const auto found = align_clouds(body, head);
    ASSERT_TRUE(found) << turn;
    const Similarity error = found->a_from_b * truth;  // the identity
    EXPECT_NEAR(error.scale, 1, 0.02) << turn;
    EXPECT_LT(angle_between(error.rotation, Eigen::Quaterniond::Identity()), 2.5 * degree) << turn;
    const Eigen::Vector3d face(0, 1.55, 0.1);
    EXPECT_LT((error * face - face).norm(), 0.006) << turn;
    EXPECT_LT(found->residual, 0.012);
    EXPECT_GT(found->overlap, 0.9);
  }
}

TEST(CloudAlignment, refuses_what_has_another_shape) {
  const std::vector<Eigen::Vector3d> body = noisy(sample_bust(700, 0.0, 1), 2);
  // A wall: flat, and wider than any head.
  std::vector<Eigen::Vector3d> wall;
  for (int i = 0; i < 400; ++i) wall.emplace_back(0.02 * (i % 20) - 0.2, 0.02 * (i / 20) - 0.4, 0.0);
  const auto found = align_clouds(body, wall);
  EXPECT_TRUE(!found || found->residual > 0.013) << found->residual;
}

TEST(CloudAlignment, needs_points) {
  const std::vector<Eigen::Vector3d> few(20, Eigen::Vector3d::Ones());
  EXPECT_FALSE(align_clouds(few, few));
  EXPECT_FALSE(align_clouds({}, {}));
}

}  // namespace
}  // namespace gyre
