// SPDX-License-Identifier: Apache-2.0
// The head goes where the face is, whatever the hair does.
#include "offload/fit/head_alignment.h"

#include "tests/offload/fit/random_person.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const BodyTemplate& human() {
  static const BodyTemplate body = built_in_template();
  return body;
}

std::vector<LandmarkTarget> face_of(const std::vector<Eigen::Vector3d>& vertices) {
  LandmarkSet set;
  for (const char* name : {"noseTip", "chin"})
    set.placed.push_back(
        {name, vertices[human().landmarks.at(name)], 1e-6 * Eigen::Matrix3d::Identity(), "picked", {}});
  return landmark_targets(human(), set);
}

OrientedPoints oriented(const PointCloud& cloud) {
  OrientedPoints points;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    points.positions.push_back(cloud.points[i].cast<double>());
    points.normals.push_back(cloud.normals[i].cast<double>());
  }
  return points;
}

TEST(AlignHead, FollowsTheFaceAndNotTheHair) {
  const BodyTemplate& body = human();
  const RandomPerson person = random_person(body, 4);
  const std::vector<double> shares = head_shares(body);
  const Eigen::Vector3d neck = person.posed.joint(body.joint_index("head"));
  // The true head is a little smaller and lower than the state's, with 3 cm of hair on its upper half.
  std::vector<Eigen::Vector3d> truth = person.posed.vertices;
  for (std::size_t v = 0; v < truth.size(); ++v)
    truth[v] += shares[v] * (0.95 * (truth[v] - neck) + neck - Eigen::Vector3d(0, 0.012, 0) - truth[v]);
  std::vector<Eigen::Vector3d> with_hair = truth;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(truth, body.mesh.triangles);
  const double nose = truth[body.landmarks.at("noseTip")].y();
  for (std::size_t v = 0; v < truth.size(); ++v)
    if (body.regions[v] == BodyRegion::head && truth[v].y() > nose + 0.04) with_hair[v] += 0.03 * normals[v];
  const OrientedPoints cloud = oriented(sample_visible(with_hair, body.mesh.triangles, {40000, 0.001, 400, 3}));
  const HeadAlignment aligned = align_head(body, outer_surface(body), cloud, face_of(truth), person.state);
  EXPECT_NEAR(aligned.scale, 0.95, 0.02);
  for (const char* name : {"noseTip", "chin"}) {
    const int v = body.landmarks.at(name);
    EXPECT_LT((aligned.vertices[v] - truth[v]).norm(), 0.003) << name;
  }
  const int crown = body.landmarks.at("crown");
  EXPECT_LT((aligned.vertices[crown] - truth[crown]).norm(), 0.012);
  // Below the neck nothing moves.
  for (std::size_t v = 0; v < shares.size(); ++v) {
    if (shares[v] == 0.0) {
      ASSERT_LT((aligned.vertices[v] - person.posed.vertices[v]).norm(), 1e-12);
    }
  }
}

TEST(AlignHead, NothingToGoByMovesNothing) {
  const BodyTemplate& body = human();
  const RandomPerson person = random_person(body, 5);
  const HeadAlignment aligned = align_head(body, outer_surface(body), {}, {}, person.state);
  for (std::size_t v = 0; v < aligned.vertices.size(); ++v) ASSERT_EQ(aligned.vertices[v], person.posed.vertices[v]);
  EXPECT_EQ(aligned.scale, 1.0);
}

TEST(AlignHead, HandsTheTurnToTheJoint) {
  const BodyTemplate& body = human();
  RandomPerson person = random_person(body, 6);
  const BodyState straight = person.state;
  Eigen::Vector3d& rotation = person.state.pose.rotations[body.joint_index("head")];
  rotation = rotation_vector_of(rotation_of({0, 0.12, 0}) * rotation_of(rotation));
  const std::vector<Eigen::Vector3d> truth = evaluate(body, person.state).vertices;
  const OrientedPoints cloud = oriented(sample_visible(truth, body.mesh.triangles, {40000, 0.0, 400, 3}));
  const HeadAlignment aligned = align_head(body, outer_surface(body), cloud, face_of(truth), straight);
  const std::vector<Eigen::Vector3d> posed = evaluate(body, aligned.state).vertices;
  const int nose = body.landmarks.at("noseTip");
  EXPECT_LT((posed[nose] - truth[nose]).norm(), 0.004);
}

// The built-in human with two ways in which faces differ: how far the nose stands out and how wide the face is.
BodyTemplate with_head_space() {
  BodyTemplate body = human();
  const std::vector<double> shares = head_shares(body);
  const Eigen::Vector3d nose = body.mesh.vertices[body.landmarks.at("noseTip")];
  Morph prominence{"prominence", {}, {}}, width{"width", {}, {}};
  for (std::size_t v = 0; v < shares.size(); ++v) {
    if (shares[v] < 0.99) continue;
    const Eigen::Vector3d from_nose = body.mesh.vertices[v] - nose;
    const auto forward = static_cast<float>(0.008 * std::exp(-from_nose.squaredNorm() / (0.03 * 0.03)));
    prominence.vertices.push_back(static_cast<int>(v));
    prominence.offsets.emplace_back(0.0F, 0.0F, forward);
    width.vertices.push_back(static_cast<int>(v));
    width.offsets.emplace_back(static_cast<float>(0.05 * body.mesh.vertices[v].x()), 0.0F, 0.0F);
  }
  body.head_shapes = {prominence, width};
  return body;
}

TEST(AlignHead, FindsTheIdentity) {
  const BodyTemplate body = with_head_space();
  RandomPerson person = random_person(body, 7);
  person.state.head = Eigen::Vector2d(1.4, -1.1);
  const std::vector<Eigen::Vector3d> truth = evaluate(body, person.state).vertices;
  const OrientedPoints cloud = oriented(sample_visible(truth, body.mesh.triangles, {80000, 0.0, 400, 3}));
  BodyState unknown = person.state;
  unknown.head = {};
  const HeadAlignment aligned = align_head(body, outer_surface(body), cloud, face_of(truth), unknown);
  ASSERT_EQ(aligned.state.head.size(), 2);
  EXPECT_NEAR(aligned.state.head[0], 1.4, 0.25);
  EXPECT_NEAR(aligned.state.head[1], -1.1, 0.25);
  double worst = 0.0;
  for (std::size_t v = 0; v < truth.size(); ++v)
    if (body.regions[v] == BodyRegion::face) worst = std::max(worst, (aligned.vertices[v] - truth[v]).norm());
  EXPECT_LT(worst, 0.0025);
}

}  // namespace
}  // namespace gyre
