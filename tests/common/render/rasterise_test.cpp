// SPDX-License-Identifier: Apache-2.0
#include "common/render/rasterise.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

// A triangle that covers the view of a camera at the origin looking along -Z, on the plane n . x = d.
TriangleMesh wall(const Eigen::Vector3d& n, double d) {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair(-4.0, -3.0), {6.0, -3.0}, {0.0, 7.0}})
    mesh.vertices.emplace_back(x, y, (d - n.x() * x - n.y() * y) / n.z());
  mesh.triangles.emplace_back(0, 1, 2);
  return mesh;
}

Pose looking_ahead() {
  return look_at({0, 0, 0}, {0, 0, -1});
}

TEST(look_at, has_the_axes_of_a_camera) {
  const Pose pose = look_at({1, 2, 3}, {1, 2, -5});
  EXPECT_NEAR((pose * Eigen::Vector3d(1, 2, 2) - Eigen::Vector3d(0, 0, 1)).norm(), 0, 1e-12);           // ahead is +z
  EXPECT_NEAR((pose * Eigen::Vector3d(2, 2, 3) - Eigen::Vector3d(1, 0, 0)).norm(), 0, 1e-12);           // right is +x
  EXPECT_NEAR((pose * Eigen::Vector3d(1, 3, 3) - Eigen::Vector3d(0, -1, 0)).norm(), 0, 1e-12);          // up is -y
  EXPECT_NEAR((centre_of(look_at({0, 3, 0}, {0, 0, 0})) - Eigen::Vector3d(0, 3, 0)).norm(), 0, 1e-12);  // straight down
}

// A slanted plane has an exact depth and point under every pixel; screen-linear weights would miss it.
TEST(rasterise, depth_and_weights_are_perspective_correct) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.5, 0.2, 1).normalized();
  const double d = -3;
  const TriangleMesh mesh = wall(n, d);
  const Camera camera = Camera::from_fov(41, 31, 0.8);
  const Pose pose = looking_ahead();
  const VisibilityBuffer seen = rasterise(mesh.vertices, mesh.triangles, camera, pose);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t i = seen.index(x, y);
      ASSERT_EQ(seen.triangle[i], 0);
      const Eigen::Vector2d xy = camera.normalised_from_pixel({x + 0.5, y + 0.5});
      const Eigen::Vector3d ray = pose.rotation.conjugate() * xy.homogeneous();
      const double depth = d / n.dot(ray);
      EXPECT_NEAR(seen.depth[i], depth, 1e-5 * depth);
      const Eigen::Vector2d w = seen.weights[i].cast<double>();
      const Eigen::Vector3d point =
          (1 - w.sum()) * mesh.vertices[0] + w[0] * mesh.vertices[1] + w[1] * mesh.vertices[2];
      EXPECT_NEAR((point - depth * ray).norm(), 0, 2e-4);
    }
}

TEST(rasterise, nearer_triangles_hide_farther_ones_in_any_order) {
  TriangleMesh mesh = wall({0, 0, 1}, -5);
  const TriangleMesh near = wall({0, 0, 1}, -2);
  mesh.vertices.insert(mesh.vertices.end(), near.vertices.begin(), near.vertices.end());
  mesh.triangles.emplace_back(3, 4, 5);
  const Camera camera = Camera::from_fov(8, 8, 0.5);
  EXPECT_EQ(rasterise(mesh.vertices, mesh.triangles, camera, looking_ahead()).triangle[9], 1);
  std::swap(mesh.triangles[0], mesh.triangles[1]);
  EXPECT_EQ(rasterise(mesh.vertices, mesh.triangles, camera, looking_ahead()).triangle[9], 0);
}

TEST(rasterise, back_faces_are_seen_only_when_asked_for) {
  TriangleMesh mesh = wall({0, 0, 1}, -2);
  std::swap(mesh.triangles[0][1], mesh.triangles[0][2]);
  const Camera camera = Camera::from_fov(8, 8, 0.5);
  EXPECT_EQ(rasterise(mesh.vertices, mesh.triangles, camera, looking_ahead()).triangle[0], -1);
  RasteriseOptions both;
  both.cull_back_faces = false;
  EXPECT_EQ(rasterise(mesh.vertices, mesh.triangles, camera, looking_ahead(), both).triangle[0], 0);
}

TEST(rasterise, what_is_behind_the_camera_is_not_seen) {
  const TriangleMesh mesh = wall({0, 0, 1}, 2);
  RasteriseOptions both;
  both.cull_back_faces = false;
  for (const int t :
       rasterise(mesh.vertices, mesh.triangles, Camera::from_fov(8, 8, 0.5), looking_ahead(), both).triangle)
    EXPECT_EQ(t, -1);
}

TEST(rasterise, neighbours_share_every_pixel_once) {
  // A fan around the image centre: no pixel may be missed on the shared edges.
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0.01, 0.02, -2);
  for (int i = 0; i < 7; ++i) mesh.vertices.emplace_back(9 * std::cos(0.9 * i), 9 * std::sin(0.9 * i), -2);
  for (int i = 0; i < 7; ++i) mesh.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % 7);
  const VisibilityBuffer seen =
      rasterise(mesh.vertices, mesh.triangles, Camera::from_fov(64, 64, 0.6), looking_ahead());
  EXPECT_EQ(std::count(seen.triangle.begin(), seen.triangle.end(), -1), 0);
}

TEST(render, shows_the_texture_upright_and_the_background_elsewhere) {
  // A square that fills the left half of the view; the texture is red above and green below (BGR).
  TriangleMesh mesh;
  mesh.vertices = {{-2, -2, -2}, {0, -2, -2}, {0, 2, -2}, {-2, 2, -2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};  // (0, 0) is the top left
  mesh.uv_triangles = mesh.triangles;
  cv::Mat texture(2, 2, CV_8UC3);
  texture.row(0) = cv::Scalar(0, 0, 200);
  texture.row(1) = cv::Scalar(0, 200, 0);
  ShadeOptions options;
  options.lit = false;
  options.background = {10, 20, 30};  // RGB
  const cv::Mat image = render(mesh, texture, Camera::from_fov(40, 40, M_PI / 2), looking_ahead(), options);
  EXPECT_EQ(image.at<cv::Vec3b>(3, 5), cv::Vec3b(0, 0, 200));
  EXPECT_EQ(image.at<cv::Vec3b>(36, 5), cv::Vec3b(0, 200, 0));
  EXPECT_EQ(image.at<cv::Vec3b>(20, 35), cv::Vec3b(30, 20, 10));
}

TEST(render, colours_of_vertices_are_mixed_by_distance) {
  TriangleMesh mesh;
  mesh.vertices = {{-2, -2, -2}, {2, -2, -2}, {2, 2, -2}, {-2, 2, -2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.colours = {Rgb(0, 0, 0), Rgb(200, 0, 0), Rgb(200, 0, 0), Rgb(0, 0, 0)};
  ShadeOptions unlit;
  unlit.lit = false;
  const cv::Mat image = render(mesh, {}, Camera::from_fov(40, 40, M_PI / 2), looking_ahead(), unlit);
  for (int x = 0; x < 40; ++x) EXPECT_NEAR(image.at<cv::Vec3b>(20, x)[2], 200 * (x + 0.5) / 40, 1.0);
}

}  // namespace
}  // namespace gyre
