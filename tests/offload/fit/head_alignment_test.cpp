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
  OrientedPoints cloud;
  const PointCloud seen = sample_visible(with_hair, body.mesh.triangles, {40000, 0.001, 400, 3});
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    cloud.positions.push_back(seen.points[i].cast<double>());
    cloud.normals.push_back(seen.normals[i].cast<double>());
  }
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
  OrientedPoints cloud;
  const PointCloud seen = sample_visible(truth, body.mesh.triangles, {40000, 0.0, 400, 3});
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    cloud.positions.push_back(seen.points[i].cast<double>());
    cloud.normals.push_back(seen.normals[i].cast<double>());
  }
  const HeadAlignment aligned = align_head(body, outer_surface(body), cloud, face_of(truth), straight);
  const std::vector<Eigen::Vector3d> posed = evaluate(body, aligned.state).vertices;
  const int nose = body.landmarks.at("noseTip");
  EXPECT_LT((posed[nose] - truth[nose]).norm(), 0.004);
}

TEST(HeadShapes, MoveTheHeadAlone) {
  BodyTemplate body;
  body.joints = {{"hips", -1, {}}, {"head", 0, {}}};
  body.skin.resize(2);
  for (int v = 0; v < 2; ++v) {
    body.skin[v].joint[0] = v;
    body.skin[v].weight[0] = 1.0F;
  }
  body.shapes = {{"tall", {0, 1}, {{0, 1, 0}, {0, 1, 0}}}, {"long nose", {1}, {{0, 0, 1}}}};
  EXPECT_EQ(head_shapes(body), std::vector<int>{1});
}

}  // namespace
}  // namespace gyre
