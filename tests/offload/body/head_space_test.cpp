// SPDX-License-Identifier: Apache-2.0
// Smooth fields, and head components handed over from a face model whose true modes are known.
#include "offload/body/head_space.h"

#include "offload/body/smooth_field.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A strip of squares along x.
TriangleMesh strip(int squares) {
  TriangleMesh mesh;
  for (int i = 0; i <= squares; ++i)
    for (double y : {0.0, 1.0}) mesh.vertices.emplace_back(i, y, 0);
  for (int i = 0; i < squares; ++i) {
    mesh.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 1);
    mesh.triangles.emplace_back(2 * i + 2, 2 * i + 3, 2 * i + 1);
  }
  return mesh;
}

TEST(SmoothField, KeepsValuesAndFadesBetween) {
  const TriangleMesh mesh = strip(20);
  std::vector<bool> active(mesh.vertices.size(), true);
  active[0] = active[1] = false;
  SmoothField field(mesh.vertices.size(), mesh.triangles, active);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mesh.vertices.size()));
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(weights.size(), 3);
  for (Eigen::Index v = 30; v < weights.size(); ++v) {
    weights[v] = 1e4;
    values.row(v) << 1, -2, 0.5;
  }
  field.factorise(weights, 1);
  const Eigen::MatrixXd solved = field.solve(values);
  EXPECT_TRUE(solved.topRows(2).isZero());
  EXPECT_LT((solved.bottomRows(10) - values.bottomRows(10)).norm(), 1e-2);
  for (int i = 1; i < 14; ++i) EXPECT_GT(solved(2 * i + 2, 0), solved(2 * i, 0) - 1e-3);
}

// The built-in human's head, finer, shifted and grown: a face model whose true correspondences are known.
struct Scene {
  BodyTemplate body = built_in_template();
  FaceModel face;

  static constexpr double growth = 1.04;
  const Eigen::Vector3d shift = Eigen::Vector3d(0.5, -0.3, 0.2);
  Eigen::Vector3d centre = Eigen::Vector3d(0, 1.58, 0);

  Scene() {
    std::map<int, int> kept;
    const auto& mesh = body.mesh;
    const auto is_head = [&](int v) { return mesh.vertices[v].y() > 1.44 && std::abs(mesh.vertices[v].x()) < 0.2; };
    const auto keep = [&](int v) {
      const auto [at, is_new] = kept.try_emplace(v, static_cast<int>(face.mesh.vertices.size()));
      if (is_new) face.mesh.vertices.push_back(mesh.vertices[v]);
      return at->second;
    };
    for (const Eigen::Vector3i& t : mesh.triangles)
      if (is_head(t[0]) && is_head(t[1]) && is_head(t[2]))
        face.mesh.triangles.emplace_back(keep(t[0]), keep(t[1]), keep(t[2]));
    const auto nearest = [&](const Eigen::Vector3d& to) {
      int best = kept.begin()->first;
      for (const auto& [v, place] : kept)
        if ((mesh.vertices[v] - to).norm() < (mesh.vertices[best] - to).norm()) best = v;
      return best;
    };
    const std::vector<std::tuple<std::string, int, Eigen::Vector3d>> points = {
        {"sellion", 27, {0, 1.6, 0.1}},
        {"noseTip", 30, {0, 1.552, 0.12}},
        {"noseBase", 33, {0, 1.54, 0.11}},
        {"chin", 8, {0, 1.485, 0.1}},
        {"leftEyeInner", 42, {0.02, 1.6, 0.1}},
        {"leftEyeOuter", 45, {0.05, 1.6, 0.08}},
        {"rightEyeInner", 39, {-0.02, 1.6, 0.1}},
        {"rightEyeOuter", 36, {-0.05, 1.6, 0.08}},
        {"leftMouthCorner", 54, {0.03, 1.52, 0.1}},
        {"rightMouthCorner", 48, {-0.03, 1.52, 0.1}},
        {"upperLip", 51, {0, 1.53, 0.11}},
        {"lowerLip", 57, {0, 1.51, 0.11}}};
    for (const auto& [name, point, at] : points) {
      body.landmarks[name] = nearest(at);
      face.landmarks[point] = kept.at(body.landmarks.at(name));
    }
    Eigen::Matrix3Xf wide(3, static_cast<Eigen::Index>(face.mesh.vertices.size()));
    for (Eigen::Index v = 0; v < wide.cols(); ++v) wide.col(v) = (widening(face.mesh.vertices[v])).cast<float>();
    face.modes = {wide};
    for (Eigen::Vector3d& v : face.mesh.vertices) v = centre + growth * (v - centre) + shift;
  }
  Eigen::Vector3d widening(const Eigen::Vector3d& at) const { return {0.08 * at.x(), 0, 0.01 * (at.y() - centre.y())}; }
};

TEST(HeadSpace, FindsTheMeanAndTheModes) {
  Scene scene;
  const Result<HeadSpace> heads = transfer_head_space(scene.body, scene.face);
  ASSERT_TRUE(heads) << heads.error().message();
  ASSERT_EQ(heads->components.size(), 2U);
  EXPECT_EQ(heads->components[0].name, "headMean");
  EXPECT_GT(heads->matched, 0.9);
  EXPECT_LT(heads->distance, 1e-3);
  scene.body.head_shapes = heads->components;
  // The mean is known up to where rigid alignment put the grown head; how lengths grow is known exactly.
  const auto mean = shaped_vertices(scene.body, {}, Eigen::VectorXd::Unit(2, 0));
  const auto wide = shaped_vertices(scene.body, {}, Eigen::VectorXd::Unit(2, 1));
  const auto& rest = scene.body.mesh.vertices;
  const int left = scene.body.landmarks.at("leftEyeOuter"), right = scene.body.landmarks.at("rightEyeOuter"),
            brow = scene.body.landmarks.at("sellion"), chin = scene.body.landmarks.at("chin");
  EXPECT_NEAR((mean[left] - mean[right]).norm() / (rest[left] - rest[right]).norm(), Scene::growth, 0.01);
  EXPECT_NEAR((mean[brow] - mean[chin]).norm() / (rest[brow] - rest[chin]).norm(), Scene::growth, 0.01);
  double worst = 0;
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (scene.body.regions[v] == BodyRegion::face && rest[v].y() > 1.5)
      worst = std::max(worst, (wide[v] - rest[v] - scene.widening(rest[v])).norm());
  EXPECT_LT(worst, 1e-3);
  // Hands and feet stay.
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (rest[v].y() < 1.3) {
      ASSERT_EQ((wide[v] - rest[v]).norm() + (mean[v] - rest[v]).norm(), 0);
    }
}

TEST(HeadSpace, SaysWhatIsMissing) {
  Scene scene;
  scene.body.landmarks.erase("leftEyeInner");
  const Result<HeadSpace> heads = transfer_head_space(scene.body, scene.face);
  ASSERT_FALSE(heads);
  EXPECT_NE(heads.error().message().find("leftEyeInner"), std::string::npos);
}

}  // namespace
}  // namespace gyre
