// SPDX-License-Identifier: Apache-2.0
#include "offload/body/smooth_correction.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr int side = 21;

int at(int i, int k) {
  return side * k + i;
}

// A sheet of 0.2 m x 0.2 m in the plane z = 0, two triangles a cell.
struct Sheet {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<int> inside;

  Sheet() {
    for (int k = 0; k < side; ++k)
      for (int i = 0; i < side; ++i) {
        vertices.emplace_back(0.01 * i, 0.01 * k, 0.0);
        if (i > 1 && i < side - 2 && k > 1 && k < side - 2) inside.push_back(at(i, k));
      }
    for (int k = 0; k + 1 < side; ++k)
      for (int i = 0; i + 1 < side; ++i) {
        triangles.emplace_back(at(i, k), at(i + 1, k), at(i + 1, k + 1));
        triangles.emplace_back(at(i, k), at(i + 1, k + 1), at(i, k + 1));
      }
  }
};

MotionCondition lift(int vertex, double amount, bool exact) {
  return {{vertex, 0, 0, 0}, {1, 0, 0, 0}, Eigen::Vector3d::UnitZ(), amount, exact, 1e-9};
}

double height(const SmoothCorrection& correction, const std::vector<Eigen::Vector3d>& motion, int vertex) {
  for (std::size_t i = 0; i < motion.size(); ++i)
    if (correction.movable()[i] == vertex) return motion[i].z();
  return 0.0;
}

TEST(SmoothCorrection, MeetsConditionsSmoothlyAndOnlyAlongThem) {
  const Sheet sheet;
  const std::vector<int> middle = {at(10, 10)};
  const SmoothCorrection correction(sheet.vertices, sheet.triangles, sheet.inside, middle);
  const std::vector<MotionCondition> conditions = {lift(at(10, 10), 0.01, true)};
  const auto motion = correction.solve(conditions);
  EXPECT_NEAR(height(correction, motion, at(10, 10)), 0.01, 1e-6);
  // A bump that falls off to the clamped end, highest where it is lifted.
  double before = 0.01;
  for (int i = 11; i < side - 2; ++i) {
    const double now = height(correction, motion, at(i, 10));
    EXPECT_LT(now, before);
    EXPECT_GT(now, -2e-4);
    before = now;
  }
  EXPECT_GT(height(correction, motion, at(11, 10)), 0.9 * 0.01);
  for (const Eigen::Vector3d& m : motion) EXPECT_LT(m.head<2>().norm(), 1e-15);
}

TEST(SmoothCorrection, OneSidedConditionsPushAndNeverPull) {
  const Sheet sheet;
  const std::vector<int> touched = {at(6, 10), at(10, 10), at(14, 10)};
  const SmoothCorrection correction(sheet.vertices, sheet.triangles, sheet.inside, touched);
  // The first lift takes the neighbours higher than they ask for.
  const std::vector<MotionCondition> conditions = {lift(touched[0], -0.02, false), lift(touched[1], 0.01, false),
                                                   lift(touched[2], 0.001, false)};
  const std::vector<MotionCondition> alone = {conditions[1]};
  const auto all = correction.solve(conditions), one = correction.solve(alone);
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_LT((all[i] - one[i]).norm(), 1e-10);
  EXPECT_NEAR(height(correction, all, touched[1]), 0.01, 2e-5);
}

TEST(SmoothCorrection, MetConditionsMoveNothing) {
  const Sheet sheet;
  const std::vector<int> touched = {at(10, 10)};
  const SmoothCorrection correction(sheet.vertices, sheet.triangles, sheet.inside, touched);
  const std::vector<MotionCondition> met = {lift(touched[0], -0.001, false)};
  for (const Eigen::Vector3d& m : correction.solve(met)) EXPECT_EQ(m.norm(), 0.0);
  EXPECT_EQ(correction.solve({}).size(), sheet.inside.size());
}

TEST(SmoothCorrection, ContradictionsAreSharedOut) {
  const Sheet sheet;
  const std::vector<int> touched = {at(10, 10)};
  const SmoothCorrection correction(sheet.vertices, sheet.triangles, sheet.inside, touched);
  const std::vector<MotionCondition> both = {lift(touched[0], 0.01, true), lift(touched[0], 0.0, true)};
  EXPECT_NEAR(height(correction, correction.solve(both), touched[0]), 0.005, 1e-4);
}

TEST(SmoothCorrection, ARelativeConditionMovesBothSides) {
  const Sheet sheet;
  const std::vector<int> touched = {at(8, 10), at(12, 10)};
  const SmoothCorrection correction(sheet.vertices, sheet.triangles, sheet.inside, touched);
  const std::vector<MotionCondition> apart = {
      {{touched[0], touched[1], 0, 0}, {1, -1, 0, 0}, Eigen::Vector3d::UnitX(), 0.004, true, 1e-9}};
  const auto motion = correction.solve(apart);
  double left = 0.0, right = 0.0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    if (correction.movable()[i] == touched[0]) left = motion[i].x();
    if (correction.movable()[i] == touched[1]) right = motion[i].x();
  }
  EXPECT_NEAR(left - right, 0.004, 1e-6);
  EXPECT_NEAR(left, -right, 1e-9);
}

}  // namespace
}  // namespace gyre
