// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_motion.h"

#include "common/geometry/pose.h"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gyre {
namespace {

constexpr double noise = 0.002;

// A body in two metres before walls at three to five, seen before and after a motion of the camera that is not known
// (now_from_then) while a share of the body's points moves aside.
std::vector<PointShift> scene(const Pose& now_from_then, double aside, double share) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr int room = 60, subject = 40;
  std::vector<PointShift> points;
  for (int i = 0; i < room + subject; ++i) {
    const bool is_subject = i >= room;
    const Eigen::Vector3d place =
        is_subject ? Eigen::Vector3d(0.25 * uniform(random), 0.8 * uniform(random), 2.0)
                   : Eigen::Vector3d(uniform(random), 1.5 * uniform(random), 1.0) * (4.0 + uniform(random));
    const bool moves = is_subject && i < room + share * subject;
    const Eigen::Vector3d seen = now_from_then * (place + Eigen::Vector3d(moves ? aside : 0.0, 0.0, 0.0));
    points.push_back({place, seen.hnormalized() - place.hnormalized(), is_subject});
  }
  return points;
}

const Pose small_step{rotation_about({0.004, -0.006, 0.002}), Eigen::Vector3d(0.02, -0.01, 0.01)};

TEST(SubjectShift, OfWhoStandsIsNothingHoweverTheCameraMoved) {
  EXPECT_LT(subject_shift(scene({}, 0.0, 0.0), noise).part, 1e-9);
  EXPECT_LT(subject_shift(scene(small_step, 0.0, 0.0), noise).part, 0.1 * noise);
}

TEST(SubjectShift, IsWhatTheSubjectMovedAgainstTheRoom) {
  for (const double aside : {0.05, -0.05, 0.1}) {
    const double truth = std::abs(aside) / 2.0;
    EXPECT_NEAR(subject_shift(scene({}, aside, 1.0), noise).half, truth, 0.1 * truth);
    EXPECT_NEAR(subject_shift(scene(small_step, aside, 1.0), noise).half, truth, 0.15 * truth);
  }
}

TEST(SubjectShift, OfAPartOfTheBodyIsSeenAndOfAHandfulOfPointsNot) {
  const SubjectShift head = subject_shift(scene(small_step, 0.1, 0.4), noise);
  EXPECT_GT(head.part, 0.8 * 0.05);
  EXPECT_LT(head.half, 0.3 * 0.05);
  EXPECT_LT(subject_shift(scene(small_step, 0.1, 0.2), noise).part, 0.3 * 0.05);
}

TEST(SubjectShift, TakesAFewPoints) {
  std::vector<PointShift> points = scene({}, 0.1, 1.0);
  points.resize(64);  // four of the subject
  EXPECT_EQ(subject_shift(points, noise).part, 0.0);
  EXPECT_EQ(subject_shift({}, noise).part, 0.0);
}

}  // namespace
}  // namespace gyre
