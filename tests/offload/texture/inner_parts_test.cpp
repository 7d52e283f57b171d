// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/inner_parts.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace gyre
