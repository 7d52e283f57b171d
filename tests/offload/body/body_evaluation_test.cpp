// SPDX-License-Identifier: Apache-2.0
// Packed evaluation, joint ranges and inverse skinning against the plain evaluation.
#include "offload/body/body_evaluator.h"
#include "offload/body/inverse_skinning.h"
#include "offload/body/joint_range.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

// The built-in human with a head component and two expressions.
const BodyTemplate& human() {
  static const BodyTemplate body = [] {
    BodyTemplate b = built_in_template();
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(-0.01F, 0.01F);
    const auto morph = [&](const char* name) {
      Morph m{name, {}, {}};
      for (int v = 100; v < static_cast<int>(b.skin.size()); v += 7) {
        m.vertices.push_back(v);
        m.offsets.emplace_back(uniform(random), uniform(random), uniform(random));
      }
      return m;
    };
    b.head_shapes = {morph("head0")};
    b.expressions = {morph("a"), morph("b")};
    return b;
  }();
  return body;
}

BodyState busy_state() {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  BodyState state = rest_state(human());
  state.scale = 1.07;
  state.pose.translation = {0.4, 0.1, -0.3};
  for (auto& r : state.pose.rotations) r = 0.4 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
  for (double& s : state.shape) s = uniform(random);
  state.head = Eigen::VectorXd::Constant(1, -1.3);
  state.expression = Eigen::Vector2d(0, 0.6);
  return state;
}

TEST(BodyEvaluator, AgreesWithThePlainEvaluation) {
  BodyEvaluator evaluator(human());
  for (const BodyState& state : {busy_state(), rest_state(human())}) {
    const PosedBody expected = evaluate(human(), state);
    const Eigen::Matrix3Xf& vertices = evaluator.vertices(state);
    ASSERT_EQ(vertices.cols(), static_cast<Eigen::Index>(expected.vertices.size()));
    for (std::size_t v = 0; v < expected.vertices.size(); ++v) {
      const auto column = static_cast<Eigen::Index>(v);
      ASSERT_LT((vertices.col(column).cast<double>() - expected.vertices[v]).norm(), 1e-5);
      ASSERT_LT((evaluator.rest_vertices().col(column).cast<double>() - expected.rest_vertices[v]).norm(), 1e-5);
    }
    for (std::size_t j = 0; j < expected.rest_joints.size(); ++j)
      EXPECT_LT((evaluator.rest_joints()[j] - expected.rest_joints[j]).norm(), 1e-5);
  }
}

TEST(InverseSkinning, PointsOfTheSurfaceComeBack) {
  const PosedBody posed = evaluate(human(), busy_state());
  const auto& triangles = human().mesh.triangles;
  for (std::size_t v = 0; v < posed.vertices.size(); v += 31) {
    const Eigen::Affine3d at = posed_from_rest_at(human(), static_cast<int>(v), posed.posed_from_rest);
    EXPECT_LT((rest_point(at, posed.vertices[v]) - posed.rest_vertices[v]).norm(), 1e-9);
  }
  // Within a triangle the blended matrix moves the rest point near the posed one: exactly where its corners share
  // theirs.
  for (std::size_t t = 0; t < triangles.size(); t += 53) {
    const Eigen::Vector3i& c = triangles[t];
    const Eigen::Vector3d w(0.2, 0.5, 0.3);
    Eigen::Vector3d rest = Eigen::Vector3d::Zero(), at = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      rest += w[k] * posed.rest_vertices[c[k]];
      at += w[k] * posed.vertices[c[k]];
    }
    const double edge = (posed.rest_vertices[c[0]] - posed.rest_vertices[c[1]]).norm();
    EXPECT_LT((rest_point(posed_from_rest_at(human(), c, w, posed.posed_from_rest), at) - rest).norm(), 0.2 * edge);
  }
}

TEST(InverseSkinning, NormalsAndRaysComeBack) {
  const PosedBody posed = evaluate(human(), busy_state());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (std::size_t v = 0; v < posed.vertices.size(); v += 101) {
    const Eigen::Affine3d posed_from_rest = posed_from_rest_at(human(), static_cast<int>(v), posed.posed_from_rest);
    const auto direction = [&] {
      return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)).normalized();
    };
    const Eigen::Vector3d normal = direction();
    // Normals are carried forwards by the inverse transpose.
    const Eigen::Vector3d posed_normal = (posed_from_rest.linear().inverse().transpose() * normal).normalized();
    EXPECT_LT((rest_normal(posed_from_rest, posed_normal) - normal).norm(), 1e-9);
    using Ray = Eigen::ParametrizedLine<double, 3>;
    const Ray rest(direction(), direction());
    const Ray ray(posed_from_rest * rest.origin(), (posed_from_rest.linear() * rest.direction()).normalized());
    const Ray back = rest_ray(posed_from_rest, ray);
    EXPECT_LT((back.origin() - rest.origin()).norm(), 1e-9);
    EXPECT_LT((back.direction() - rest.direction()).norm(), 1e-9);
    // A sight line through a point of the posed surface goes through its rest point.
    const Ray sight(posed.vertices[v] - 2 * ray.direction(), ray.direction());
    const Ray in_rest = rest_ray(posed_from_rest, sight);
    const Eigen::Vector3d to_point = posed.rest_vertices[v] - in_rest.origin();
    EXPECT_LT(to_point.cross(in_rest.direction()).norm(), 1e-9);
  }
}

TEST(JointRange, RestIsWithinAndLimitsAreKept) {
  for (const Joint& joint : human().joints) {
    EXPECT_TRUE(beyond(joint.range, Eigen::Vector3d::Zero()).isZero()) << joint.name;
    const Eigen::Vector3d wild(3, -3, 3);
    EXPECT_TRUE(beyond(joint.range, within(joint.range, wild)).isZero(1e-9)) << joint.name;
    EXPECT_TRUE((joint.range.axes.transpose() * joint.range.axes).isIdentity(1e-9)) << joint.name;
  }
}

// Elbows and knees bend one way only: the hand comes forwards, the foot goes back.
TEST(JointRange, HingesBendTheRightWay) {
  const auto rest_joints = joint_positions(human(), human().mesh.vertices);
  const auto turned = [&](const char* hinge, const char* end, double angle) {
    const int joint = human().joint_index(hinge), tip = human().joint_index(end);
    BodyPose pose = rest_state(human()).pose;
    pose.rotations[joint] = within(human().joints[joint].range, angle * human().joints[joint].range.axes.col(1));
    return Eigen::Vector3d(joint_transforms(human(), rest_joints, pose)[tip] * rest_joints[tip] - rest_joints[tip]);
  };
  for (const std::string side : {"left", "right"}) {
    EXPECT_GT(turned((side + "LowerArm").c_str(), (side + "Hand").c_str(), 1.5).z(), 0.1);
    EXPECT_GT(turned((side + "LowerArm").c_str(), (side + "Hand").c_str(), -1.5).z(), -0.1);
    EXPECT_LT(turned((side + "LowerLeg").c_str(), (side + "Foot").c_str(), -1.5).z(), -0.2);
    EXPECT_LT(turned((side + "LowerLeg").c_str(), (side + "Foot").c_str(), 1.5).z(), 0.15);
  }
}

// Fingers close towards the palm, on both hands alike.
TEST(JointRange, FingersCloseOnBothSides) {
  const auto rest_joints = joint_positions(human(), human().mesh.vertices);
  for (const std::string side : {"left", "right"}) {
    const int joint = human().joint_index(side + "MiddleProximal"), tip = human().joint_index(side + "MiddleDistal");
    const JointRange& range = human().joints[joint].range;
    BodyPose pose = rest_state(human()).pose;
    pose.rotations[joint] = range.axes.col(1);
    const Eigen::Vector3d moved =
        joint_transforms(human(), rest_joints, pose)[tip] * rest_joints[tip] - rest_joints[tip];
    // The built-in human's palms face down and inwards.
    EXPECT_LT(moved.x() * (side == "left" ? 1 : -1), 0);
    EXPECT_GT(range.most[1], -range.least[1]);
  }
}

}  // namespace
}  // namespace gyre
