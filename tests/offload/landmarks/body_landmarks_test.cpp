// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/body_landmarks.h"

#include "offload/landmarks/subject.h"
#include "tests/offload/landmarks/people.h"

#include <gtest/gtest.h>
#include <numbers>

namespace gyre {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

struct Found {
  Subject subject;
  Detections detections;

  const PlacedLandmark* mark(const std::string& name) const {
    for (const PlacedLandmark& m : detections.placed)
      if (m.name == name) return &m;
    return nullptr;
  }
};

Found find(const Person& person) {
  auto subject = make_subject(person.cloud, {});
  EXPECT_TRUE(subject) << subject.error().message();
  Found found{std::move(*subject), {}};
  find_body_landmarks(found.subject, found.detections);
  return found;
}

double turned_by(double a, double b) {
  return std::abs(std::remainder(a - b, 2 * std::numbers::pi));
}

// Every placed landmark of a side lies on that side.
void expect_sides(const Found& found, const Person& person) {
  const Eigen::Vector3d left(std::cos(person.yaw), 0, -std::sin(person.yaw));
  for (const PlacedLandmark& mark : found.detections.placed) {
    if (mark.name.starts_with("left")) {
      EXPECT_GT(mark.position.dot(left), 0) << mark.name;
    }
    if (mark.name.starts_with("right")) {
      EXPECT_LT(mark.position.dot(left), 0) << mark.name;
    }
  }
}

// A hole in front of a landmark may cost the facing, never turn it round.
void expect_never_wrong(const Found& found, const Person& person) {
  if (found.subject.facing.towards_across) {
    EXPECT_LT(turned_by(found.subject.facing.yaw, person.yaw), 15 * degree);
    expect_sides(found, person);
  }
}

double distance(const Found& found, const std::string& name, const Eigen::Vector3d& place) {
  const PlacedLandmark* mark = found.mark(name);
  EXPECT_NE(mark, nullptr) << name;
  return mark == nullptr ? 1e9 : (mark->position - place).norm();
}

TEST(BodyLandmarks, LieWhereTheSkeletonSays) {
  for (const double stature : {1.55, 1.88}) {
    const Person person = synthetic_person({.stature = stature, .yaw = 70 * degree});
    const Found found = find(person);
    ASSERT_TRUE(found.subject.facing.towards_across);
    EXPECT_LT(turned_by(found.subject.facing.yaw, person.yaw), 5 * degree);
    expect_sides(found, person);
    for (const std::string side : {"left", "right"}) {
      const std::string joint = side == "left" ? "Left" : "Right";
      const auto at = [&](const char* name) { return person.joints.at(joint + name); };
      // Surface landmarks lie a limb's radius away from the joints.
      EXPECT_LT(distance(found, side + "Elbow", at("ForeArm")), 0.08);
      EXPECT_LT(distance(found, side + "Wrist", at("Hand")), 0.07);
      EXPECT_LT(distance(found, side + "Knee", at("Leg")), 0.11);
      EXPECT_LT(distance(found, side + "Ankle", at("Foot")), 0.07);
      const Eigen::Vector3d tip = at("Hand") + 0.18 * stature / 1.70 * (at("Hand") - at("ForeArm")).normalized();
      EXPECT_LT(distance(found, side + "Fingertip", tip), 0.025);
    }
    const Eigen::Vector3d crown = found.mark("crown")->position;
    EXPECT_NEAR(crown.y(), stature, 0.012);
    ASSERT_NE(found.mark("crotch"), nullptr);
    EXPECT_NEAR(found.mark("crotch")->position.y(), 0.46 * stature, 0.05 * stature);
  }
}

TEST(BodyLandmarks, HeelsAndToesEndTheShoes) {
  const Person person = synthetic_person({});
  const Found found = find(person);
  for (const std::string side : {"left", "right"}) {
    ASSERT_NE(found.mark(side + "Heel"), nullptr);
    ASSERT_NE(found.mark(side + "Toe"), nullptr);
    EXPECT_NEAR(found.mark(side + "Heel")->position.z(), -0.045 - 0.044, 0.012);
    EXPECT_NEAR(found.mark(side + "Toe")->position.z(), 0.145 + 0.036, 0.012);
  }
}

TEST(BodyLandmarks, FacingIsRightFromAllSides) {
  for (int turn = -180; turn < 180; turn += 30) {
    const Person person = synthetic_person({.yaw = turn * degree, .points = 30000});
    const Found found = find(person);
    ASSERT_TRUE(found.subject.facing.towards_across) << turn;
    EXPECT_LT(turned_by(found.subject.facing.yaw, person.yaw), 8 * degree) << turn;
    expect_sides(found, person);
  }
}

TEST(BodyLandmarks, AMissingArmIsMissing) {
  const Person person =
      synthetic_person({.yaw = 0.4, .hole = [](const Eigen::Vector3d& p) { return p.x() > 0.24 && p.y() > 0.5; }});
  const Found found = find(person);
  ASSERT_TRUE(found.subject.facing.towards_across);
  expect_never_wrong(found, person);
  for (const char* part : {"leftElbow", "leftWrist", "leftFingertip"}) {
    EXPECT_EQ(found.mark(part), nullptr) << part;
    EXPECT_TRUE(found.detections.missing.contains(part));
  }
  EXPECT_NE(found.mark("rightFingertip"), nullptr);
}

TEST(BodyLandmarks, DarkLegsCostTheLegsOnly) {
  const Person person =
      synthetic_person({.yaw = -1.0, .hole = [](const Eigen::Vector3d& p) { return p.y() > 0.09 && p.y() < 0.9; }});
  const Found found = find(person);
  expect_never_wrong(found, person);
  EXPECT_EQ(found.mark("leftKnee"), nullptr);
  EXPECT_EQ(found.mark("crotch"), nullptr);
  ASSERT_TRUE(found.subject.facing.towards_across);
  EXPECT_NE(found.mark("leftFingertip"), nullptr);
}

TEST(BodyLandmarks, WithoutFaceAndFeetTheFacingIsOpenRatherThanWrong) {
  for (const double yaw : {0.0, 2.0}) {
    const Person person = synthetic_person(
        {.yaw = yaw, .hole = [](const Eigen::Vector3d& p) { return p.y() < 0.2 || (p.y() > 1.45 && p.z() > 0.03); }});
    expect_never_wrong(find(person), person);
  }
}

TEST(BodyLandmarks, HolesInTheArmsAndNoiseDoNotSwapSides) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Person person = synthetic_person({.stature = 1.6 + 0.07 * static_cast<double>(seed),
                                            .yaw = 1.3 * static_cast<double>(seed),
                                            .points = 40000,
                                            .seed = seed,
                                            .hole = [seed](const Eigen::Vector3d& p) {
                                              // Bands across the arms.
                                              return std::abs(p.x()) > 0.2 &&
                                                     std::fmod(p.y() + 0.03 * static_cast<double>(seed), 0.2) < 0.03;
                                            }});
    const Found found = find(person);
    ASSERT_TRUE(found.subject.facing.towards_across) << seed;
    expect_never_wrong(found, person);
  }
}

TEST(BodyLandmarks, TooFewPointsAreAnError) {
  PointCloud cloud;
  for (int i = 0; i < 50; ++i) cloud.points.emplace_back(0.01F * static_cast<float>(i), 0, 0);
  EXPECT_FALSE(make_subject(cloud, {}));
}

}  // namespace
}  // namespace gyre
