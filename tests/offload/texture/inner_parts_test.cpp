// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/inner_parts.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

// A body triangle, an eye (an octahedron of 12 mm) and a row of teeth.
BodyTemplate face_parts() {
  BodyTemplate body;
  body.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  body.mesh.triangles = {{0, 1, 2}};
  body.parts.push_back({"body", 0, 3, 0, 1});
  for (int k = 0; k < 6; ++k) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    p[k / 2] = k % 2 == 0 ? 0.012 : -0.012;
    body.mesh.vertices.push_back(Eigen::Vector3d(0.03, 1.5, 0.08) + p);
  }
  body.parts.push_back({"leftEye", 3, 6, 1, 8});
  for (const int x : {3, 4}) {
    for (const int y : {5, 6}) {
      for (const int z : {7, 8}) body.mesh.triangles.emplace_back(x, y, z);
    }
  }
  for (const double x : {0.0, 0.01, 0.02}) body.mesh.vertices.emplace_back(x, 1.45, 0.08);
  body.mesh.triangles.emplace_back(9, 10, 11);
  body.parts.push_back({"upperTeeth", 9, 3, 9, 1});
  body.regions.assign(body.mesh.vertices.size(), BodyRegion::face);
  return body;
}

TEST(InnerPaint, CoversThePartsAndNotTheSkin) {
  const BodyTemplate body = face_parts();
  const InnerPaint paint(body);
  EXPECT_EQ(paint.covered()[0], 0);
  for (std::size_t t = 1; t < body.mesh.triangles.size(); ++t) EXPECT_EQ(paint.covered()[t], 1);
}

TEST(InnerPaint, PutsADarkPupilInTheMiddleOfAWhiteEye) {
  const BodyTemplate body = face_parts();
  const InnerPaint paint(body);
  const Eigen::Vector3f front = paint.colour(1, {0, 0, 1});  // the corner towards +Z
  const Eigen::Vector3f side = paint.colour(1, {0.5, 0.2, 0.3});
  EXPECT_LT(front.maxCoeff(), 40.0F);
  EXPECT_GT(side.minCoeff(), 140.0F);
}

TEST(InnerPaint, TeethAreBright) {
  const BodyTemplate body = face_parts();
  EXPECT_GT(InnerPaint(body).colour(9, {0.3, 0.3, 0.4}).minCoeff(), 180.0F);
}

TEST(InnerPaint, MatchesThePersonsEyes) {
  const BodyTemplate body = face_parts();
  InnerPaint paint(body);
  const EyeColours person{{140, 120, 60}, Eigen::Vector3f(200, 205, 215)};  // a blue iris in dim light
  paint.match(person);
  const Eigen::Vector3f white = paint.colour(1, {0.456, 0.0, 0.544});  // 40 degrees from the axis
  EXPECT_LT((white - *person.sclera).norm(), 1.0F);
  EXPECT_LT(paint.colour(9, {0.3, 0.3, 0.4}).mean(), InnerPaint(body).colour(9, {0.3, 0.3, 0.4}).mean());
}

TEST(Lab, ComesBack) {
  for (const Eigen::Vector3f& bgr :
       {Eigen::Vector3f(3, 2, 1), Eigen::Vector3f(200, 20, 90), Eigen::Vector3f(255, 255, 255)}) {
    EXPECT_LT((bgr_from_lab(lab_from_bgr(bgr)) - bgr).norm(), 0.1F);
  }
}

// A ball with a brown disc towards +Z, all of it an eye.
TEST(EyeColours, AreMeasuredWherePhotographsLookIntoTheEyes) {
  BodyTemplate body;
  scene::add_ball(body.mesh, 0.012, 16);
  body.parts.push_back(
      {"leftEye", 0, static_cast<int>(body.mesh.vertices.size()), 0, static_cast<int>(body.mesh.triangles.size())});
  const Atlas atlas = map_atlas(body.mesh.uv, body.mesh.uv_triangles, 512, 4);
  cv::Mat texture(512, 512, CV_8UC3, cv::Scalar(210, 220, 225));
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const bool is_iris = texel_point(body.mesh, atlas, i).normalized().z() > std::cos(0.5);
    if (is_iris) texture.at<cv::Vec3b>(static_cast<int>(i) / 512, static_cast<int>(i) % 512) = {40, 60, 110};
  }
  std::vector<Photo> photos = {scene::photograph(body.mesh, texture, {0.01, 0.0, 0.08}),
                               scene::photograph(body.mesh, texture, {0.0, 0.0, -0.08})};
  const auto eyes = measure_eyes(body, body.mesh.vertices, photos, 2);
  ASSERT_TRUE(eyes && eyes->sclera);
  EXPECT_LT((eyes->iris - Eigen::Vector3f(40, 60, 110)).norm(), 4.0F);
  EXPECT_LT((*eyes->sclera - Eigen::Vector3f(210, 220, 225)).norm(), 4.0F);
  for (Photo& photo : photos) cv::multiply(photo.image, cv::Scalar(0.6, 0.8, 1.0), photo.image);
  const auto skin = measure_eyes(body, body.mesh.vertices, photos, 2);
  ASSERT_TRUE(skin);
  EXPECT_FALSE(skin->sclera);
  photos.erase(photos.begin());
  EXPECT_FALSE(measure_eyes(body, body.mesh.vertices, photos, 2));
}

}  // namespace
}  // namespace gyre
