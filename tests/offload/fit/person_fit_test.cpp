// SPDX-License-Identifier: Apache-2.0
// Closed loop: the built-in human in random shapes and poses is sampled to a cloud and must come back.
#include "offload/fit/person_fit.h"

#include "common/mesh/closest_point.h"
#include "offload/fit/cloud_preparation.h"
#include "offload/fit/rest_surface.h"
#include "tests/offload/fit/random_person.h"

#include <gtest/gtest.h>
#include <numbers>
#include <random>

namespace gyre {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

const BodyTemplate& human() {
  static const BodyTemplate body = built_in_template();
  return body;
}

// Somebody in A-pose at the origin, facing `yaw`.
BodyState somebody(std::uint64_t seed, double yaw) {
  const BodyTemplate& body = human();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Stance stance;
  stance.height = 1.7 + 0.1 * uniform(random);
  const Eigen::Matrix3d facing = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  stance.lateral = facing * Eigen::Vector3d::UnitX();
  BodyState state = stand_like(body, stance, yaw);
  for (const char* name : {"leftUpperArm", "rightUpperArm", "leftLowerArm", "rightLowerArm", "spine", "head"}) {
    const int joint = body.joint_index(name);
    const Eigen::Vector3d turn = 4 * degree * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    state.pose.rotations[joint] = rotation_vector_of(rotation_of(turn) * rotation_of(state.pose.rotations[joint]));
  }
  for (Eigen::Index s = 0; s < state.shape.size(); ++s) state.shape[s] = uniform(random);
  return state;
}

PointCloud cloud_of(const PosedBody& posed, int points = 12000) {
  return sample_visible(posed.vertices, human().mesh.triangles, {points, 0.002, 300, 5});
}

PersonFitOptions quick() {
  PersonFitOptions options;
  options.coarse.iterations = 24;
  options.coarse.cloud_points = 2500;
  options.coarse.surface_cell = 0.03;
  options.nonrigid.steps = 3;
  options.nonrigid.searches = 2;
  options.nonrigid.points_per_vertex = 1.0;
  return options;
}

double mean_distance(const ClosestPoint& surface, const PointCloud& cloud) {
  double sum = 0.0;
  for (const Eigen::Vector3f& p : cloud.points) sum += surface.nearest(p.cast<double>())->distance;
  return sum / static_cast<double>(cloud.points.size());
}

double worst_joint(const PersonFit& fit, const PosedBody& truth, const std::vector<std::string>& names) {
  double worst = 0.0;
  for (const std::string& name : names) {
    const int j = human().joint_index(name);
    worst = std::max(worst, (fit.posed_from_rest[j] * fit.rest_joints[j] - truth.joint(j)).norm());
  }
  return worst;
}

double turn_between(double a, double b) {
  return std::abs(std::remainder(a - b, 2 * std::numbers::pi));
}

class ClosedLoop : public testing::TestWithParam<int> {};

TEST_P(ClosedLoop, ShapeAndPoseComeBack) {
  const double yaw = -2.9 + 1.3 * GetParam();
  const PosedBody truth = evaluate(human(), somebody(100 + GetParam(), yaw));
  const PointCloud cloud = cloud_of(truth);
  const auto fit = fit_person(human(), cloud, {}, quick());
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(turn_between(yaw_of(fit->pose), yaw), 5 * degree);
  EXPECT_LT(mean_distance(ClosestPoint(fit->vertices, human().mesh.triangles), cloud), 0.0035);
  EXPECT_LT(mean_distance(ClosestPoint(truth.vertices, human().mesh.triangles),
                          sample_visible(fit->vertices, human().mesh.triangles, {5000, 0.0, 200, 9})),
            0.003);
  EXPECT_LT(worst_joint(*fit, truth,
                        {"hips", "leftUpperArm", "rightUpperArm", "leftLowerArm", "rightLowerArm", "leftUpperLeg",
                         "rightUpperLeg", "leftLowerLeg", "rightLowerLeg"}),
            0.03);
  EXPECT_TRUE(fit->warnings.empty()) << fit->warnings.front();
}

INSTANTIATE_TEST_SUITE_P(Seeds, ClosedLoop, testing::Range(0, 4));

TEST(Facing, IsRightForEveryHeading) {
  const BodyTemplate& body = human();
  const PointCloud cloud = cloud_of(evaluate(body, somebody(1, 0.0)), 8000);
  for (int i = 0; i < 12; ++i) {
    const double yaw = 30 * degree * i;
    const auto points = prepare_cloud(moved(cloud, yaw, Eigen::Vector3d::Zero()));
    ASSERT_TRUE(points);
    const Stance stance = measure_stance(*points);
    EXPECT_LT(turn_between(heading(stance, stance.toes > 0), yaw), 12 * degree) << i;
    EXPECT_GT(std::abs(stance.toes), 0.01);
    EXPECT_GT(stance.elongation, 2.0);
  }
}

TEST(Facing, IsRightWithoutFeet) {
  for (const double yaw : {0.4, 3.0}) {
    PointCloud cloud = cloud_of(evaluate(human(), somebody(2, yaw)));
    PointCloud cut;
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      if (cloud.points[i].y() < 0.35f) continue;
      cut.points.push_back(cloud.points[i]);
      cut.normals.push_back(cloud.normals[i]);
    }
    const auto fit = fit_person(human(), cut, {}, quick());
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->guesses.front().toes, 0.0);
    EXPECT_LT(turn_between(yaw_of(fit->pose), yaw), 8 * degree);
    EXPECT_LT(fit->quality.support.at("left foot"), 0.1);
    const auto& guessed = fit->quality.prior_only;
    EXPECT_NE(std::find(guessed.begin(), guessed.end(), "left foot"), guessed.end());
    EXPECT_EQ(std::find(guessed.begin(), guessed.end(), "torso"), guessed.end());
    EXPECT_GT(fit->measures.at("stature").deviation, 0.02);
    EXPECT_FALSE(fit->warnings.empty());
  }
}

TEST(Robustness, MissingArmStraysAndFloorOnlyCostTheArm) {
  const BodyTemplate& body = human();
  const PosedBody truth = evaluate(body, somebody(7, 0.5));
  const PointCloud whole = cloud_of(truth);
  const Eigen::Vector3d shoulder = truth.joint(body.joint_index("leftUpperArm"));
  const Eigen::Vector3d left = truth.posed_from_rest[0].linear() * Eigen::Vector3d::UnitX();
  PointCloud cloud;
  const auto add = [&](const Eigen::Vector3f& p, const Eigen::Vector3f& n) {
    cloud.points.push_back(p);
    cloud.normals.push_back(n);
  };
  for (std::size_t i = 0; i < whole.points.size(); ++i)
    if ((whole.points[i].cast<double>() - shoulder).dot(left) < 0.06 || whole.points[i].y() < 0.6f)
      add(whole.points[i], whole.normals[i]);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  for (int i = 0; i < 30; ++i)
    add({1.5f * uniform(random), 1.0f + uniform(random), 1.5f * uniform(random)}, Eigen::Vector3f::UnitY());
  for (int i = 0; i < 2000; ++i)
    add({0.6f * uniform(random), 0.01f * uniform(random), 0.6f * uniform(random)}, Eigen::Vector3f::UnitY());

  const auto fit = fit_person(body, cloud, {}, quick());
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(turn_between(yaw_of(fit->pose), 0.5), 6 * degree);
  EXPECT_LT(fit->quality.support.at("left hand"), 0.1);
  EXPECT_GT(fit->quality.support.at("right arm"), 0.7);
  EXPECT_LT(worst_joint(*fit, truth, {"rightUpperArm", "rightLowerArm", "leftUpperLeg", "leftLowerLeg"}), 0.04);
  const int lost = body.landmarks.at("leftWrist"), kept = body.landmarks.at("rightElbow");
  EXPECT_EQ(fit->quality.confidence[lost], 0.0);
  EXPECT_TRUE(std::isnan(fit->quality.residual[lost]));
  EXPECT_GT(fit->quality.confidence[kept], 0.3);
  EXPECT_LT(fit->quality.residual[kept], 0.01);
  EXPECT_GT(fit->measures.at("left_arm").deviation, 1.5 * fit->measures.at("right_arm").deviation);
  // The guessed arm mirrors the other one, whole and not torn away.
  EXPECT_LT(worst_joint(*fit, truth, {"leftUpperArm", "leftLowerArm", "leftHand"}), 0.15);
}

// The coarse fit is taken from one heading only, so a certain heading that is wrong must show.
TEST(Landmarks, ACertainHeadingIsBelieved) {
  const RandomPerson person = random_person(human(), 21);
  LandmarkSet landmarks;
  landmarks.yaw = person.yaw;
  landmarks.yaw_certainty = 0.95;
  const auto fit = fit_person(human(), cloud_of(person.posed, 8000), landmarks, quick());
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->guesses.size(), 1U);
  EXPECT_LT(turn_between(yaw_of(fit->pose), person.yaw), 5 * degree);
}

TEST(Landmarks, FewPointsAndLandmarksMakeABody) {
  const BodyTemplate& body = human();
  const RandomPerson person = random_person(body, 22);
  LandmarkSet landmarks;
  for (const auto& [name, vertex] : body.landmarks)
    if (name != "crown" && name != "leftKnee")
      landmarks.placed.push_back(
          {name, person.posed.vertices[vertex], 4e-6 * Eigen::Matrix3d::Identity(), "picked", {}});
  landmarks.placed.push_back({"unheardOf", {0, 9, 0}, 4e-6 * Eigen::Matrix3d::Identity(), "picked", {}});
  // A trunk without limbs or head.
  const PointCloud trunk = only(cloud_of(person.posed), [&](const Eigen::Vector3d& p) {
    return p.y() > 0.9 && p.y() < 1.3 && Eigen::Vector2d(p.x(), p.z()).norm() < 0.2;
  });
  const auto fit = fit_person(body, trunk, landmarks, quick());
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(turn_between(yaw_of(fit->pose), person.yaw), 6 * degree);
  EXPECT_LT(worst_joint(*fit, person.posed, {"leftLowerArm", "rightHand", "leftFoot", "rightFoot", "leftHand"}), 0.06);
}

TEST(Measures, OfAKnownPersonComeBack) {
  const BodyTemplate& body = human();
  const RandomPerson person = random_person(body, 23);
  const auto fit = fit_person(body, cloud_of(person.posed), {}, quick());
  ASSERT_TRUE(fit);
  std::vector<Eigen::Vector3d> rest = person.posed.rest_vertices;
  double sole = 1.0;
  for (const Eigen::Vector3d& v : rest) sole = std::min(sole, v.y());
  for (Eigen::Vector3d& v : rest) v.y() -= sole;
  double top = 0.0;
  for (const Eigen::Vector3d& v : person.posed.vertices) top = std::max(top, v.y());
  const auto truth = measure_person(body, rest, std::vector<double>(rest.size(), 1.0), 0.0, 0.0, top, -1.0);
  EXPECT_TRUE(truth.contains("stature"));
  EXPECT_TRUE(truth.contains("inseam"));
  for (const auto& [name, measure] : truth) {
    EXPECT_NEAR(fit->measures.at(name).value, measure.value, std::max(0.015, 2.5 * fit->measures.at(name).deviation))
        << name;
    EXPECT_GT(fit->measures.at(name).deviation, measure.deviation) << name;
  }
  EXPECT_NEAR(fit->stature, top, 0.004);
  EXPECT_FALSE(truth.contains("stature_without_hair"));
}

TEST(Robustness, BadClouds) {
  EXPECT_FALSE(fit_person(human(), {}));
  PointCloud without_normals;
  without_normals.points.emplace_back(0, 1, 0);
  EXPECT_FALSE(fit_person(human(), without_normals));
  PointCloud nan;
  nan.points.emplace_back(std::nanf(""), 1, 0);
  nan.normals.emplace_back(0, 1, 0);
  EXPECT_FALSE(fit_person(human(), nan));
}

TEST(Robustness, AThingIsFittedWithAWarning) {
  PointCloud ball;
  for (int i = 0; i < 3000; ++i) {
    const double z = 2.0 * (i + 0.5) / 3000 - 1.0, angle = 2.4 * i, r = std::sqrt(1 - z * z);
    const Eigen::Vector3d n(r * std::cos(angle), z, r * std::sin(angle));
    ball.points.emplace_back((0.4 * n + Eigen::Vector3d(0, 0.4, 0)).cast<float>());
    ball.normals.emplace_back(n.cast<float>());
  }
  const auto fit = fit_person(human(), ball, {}, quick());
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_FALSE(fit->warnings.empty());
  for (const Eigen::Vector3d& v : fit->vertices) ASSERT_TRUE(v.allFinite());
}

TEST(Unpose, SkinningTheRestSurfaceGivesThePosedOne) {
  const BodyTemplate& body = human();
  const BodyState state = somebody(11, 2.0);
  const PosedBody posed = evaluate(body, state);
  std::vector<Eigen::Vector3d> wrinkled = posed.vertices;
  for (std::size_t v = 0; v < wrinkled.size(); ++v) wrinkled[v] += 0.005 * std::sin(0.1 * v) * posed.normals[v];
  const RestSurface rest = unpose(body, wrinkled, posed.rest_joints, state.pose);
  const auto again = skin_vertices(body, rest.vertices, rest.posed_from_rest);
  const auto joints = joint_positions(body, rest.vertices);
  double lowest = 1.0;
  for (std::size_t v = 0; v < again.size(); ++v) {
    EXPECT_LT((again[v] - wrinkled[v]).norm(), 1e-9);
    lowest = std::min(lowest, rest.vertices[v].y());
  }
  EXPECT_NEAR(lowest, 0.0, 1e-4);
  for (std::size_t j = 0; j < joints.size(); ++j) EXPECT_LT((joints[j] - rest.joints[j]).norm(), 1e-3);
  const auto transforms = joint_transforms(body, rest.joints, rest.pose);
  for (std::size_t j = 0; j < joints.size(); ++j)
    EXPECT_LT((transforms[j].matrix() - rest.posed_from_rest[j].matrix()).norm(), 1e-12);
}

TEST(PrepareCloud, DropsFloorAndStrays) {
  PointCloud cloud;
  for (int i = 0; i < 400; ++i) {
    cloud.points.emplace_back(0.01f * (i % 20), 0.5f + 0.01f * (i / 20), 0.0f);
    cloud.normals.emplace_back(0, 0, 1);
  }
  cloud.points.emplace_back(0.1f, 0.01f, 0.0f);
  cloud.normals.emplace_back(0, 1, 0);
  PreparationOptions options;
  options.smallest_share = 0.05;
  cloud.points.emplace_back(3.0f, 1.0f, 0.0f);
  cloud.normals.emplace_back(0, 0, 1);
  const auto prepared = prepare_cloud(cloud, options);
  ASSERT_TRUE(prepared);
  EXPECT_EQ(prepared->size(), 400U);
  const double cell = cell_for_count(*prepared, 100);
  EXPECT_NEAR(static_cast<double>(thin(*prepared, cell).size()), 100, 40);
}

}  // namespace
}  // namespace gyre
