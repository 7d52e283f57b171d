// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/rotation_averaging.h"

#include "common/geometry/pose.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr int views = 40;

Eigen::Quaterniond small_turn(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const Eigen::Vector3d w(normal(random), normal(random), normal(random));
  return Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized()));
}

std::vector<Eigen::Quaterniond> ring() {
  std::vector<Eigen::Quaterniond> rotations;
  for (int v = 0; v < views; ++v)
    rotations.emplace_back(Eigen::AngleAxisd(2 * M_PI * v / views, Eigen::Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.2 * std::sin(3.0 * v), Eigen::Vector3d::UnitX()));
  return rotations;
}

// Neighbours up to three apart, all around.
std::vector<RelativeRotation> neighbours(const std::vector<Eigen::Quaterniond>& truth) {
  std::vector<RelativeRotation> relative;
  for (int a = 0; a < views; ++a)
    for (int step = 1; step <= 3; ++step) {
      const int b = (a + step) % views;
      relative.push_back({a, b, truth[b] * truth[a].conjugate(), 100.0 / step});
    }
  return relative;
}

double largest_error(const RotationAverage& average, const std::vector<Eigen::Quaterniond>& truth) {
  const Eigen::Quaterniond world = average.cam_from_world[0]->conjugate() * truth[0];
  double largest = 0;
  for (int v = 0; v < views; ++v)
    largest = std::max(largest, angle_between(*average.cam_from_world[v] * world, truth[v]));
  return largest;
}

TEST(RotationAveraging, ExactRotationsAreFoundExactly) {
  const auto truth = ring();
  const RotationAverage average = average_rotations(views, neighbours(truth));
  EXPECT_LT(largest_error(average, truth), 1e-7);
  for (const double d : average.disagreement) EXPECT_LT(d, 1e-7);
}

// A chain of 39 steps piles its errors up; the ring shares them.
TEST(RotationAveraging, ARingClosesWithoutDrift) {
  const auto truth = ring();
  std::mt19937 random(5);
  auto relative = neighbours(truth);
  for (RelativeRotation& r : relative) r.b_from_a = small_turn(random, 0.01) * r.b_from_a;
  const RotationAverage average = average_rotations(views, relative);
  const RotationAverage chain = average_rotations(views, relative, {.first_iterations = 0, .iterations = 0});
  EXPECT_LT(largest_error(average, truth), 0.6 * largest_error(chain, truth));
  const Eigen::Quaterniond closing = *average.cam_from_world[0] * average.cam_from_world[views - 1]->conjugate();
  EXPECT_LT(angle_between(closing, truth[0] * truth[views - 1].conjugate()), 0.012);
}

TEST(RotationAveraging, FalsePairsAreToldFromTrueOnes) {
  const auto truth = ring();
  std::mt19937 random(7);
  auto relative = neighbours(truth);
  for (RelativeRotation& r : relative) r.b_from_a = small_turn(random, 0.002) * r.b_from_a;
  const std::size_t true_pairs = relative.size();
  for (int i = 0; i < 30; ++i) {
    const int a = static_cast<int>(random() % views), b = (a + 10 + static_cast<int>(random() % 20)) % views;
    relative.push_back({a, b, Eigen::Quaterniond::Identity(), 40.0});  // look-alike walls: "the same view again"
  }
  const RotationAverage average = average_rotations(views, relative);
  EXPECT_LT(largest_error(average, truth), 0.02);
  for (std::size_t k = 0; k < relative.size(); ++k) {
    if (k < true_pairs) {
      EXPECT_LT(average.disagreement[k], 0.03);
    } else {
      EXPECT_GT(average.disagreement[k], 0.5);
    }
  }
}

TEST(RotationAveraging, ViewsWithoutConnectionHaveNoRotation) {
  const auto truth = ring();
  auto relative = neighbours(truth);
  relative.push_back({views, views + 1, Eigen::Quaterniond::Identity(), 1e6});
  const RotationAverage average = average_rotations(views + 3, relative);
  EXPECT_TRUE(average.cam_from_world[views - 1]);
  for (int v = views; v < views + 3; ++v) EXPECT_FALSE(average.cam_from_world[v]);
  EXPECT_TRUE(std::isinf(average.disagreement.back()));
}

}  // namespace
}  // namespace gyre
