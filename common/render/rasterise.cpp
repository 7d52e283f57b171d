// SPDX-License-Identifier: Apache-2.0
#include "common/render/rasterise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

struct ScreenVertex {
  double x, y, z;
};

double edge(const ScreenVertex& a, const ScreenVertex& b, double x, double y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

Eigen::Vector3d sample_bilinear(const cv::Mat& texture, const Eigen::Vector2d& uv) {
  const double x = std::clamp(uv.x() * texture.cols - 0.5, 0.0, texture.cols - 1.0);
  const double y = std::clamp(uv.y() * texture.rows - 0.5, 0.0, texture.rows - 1.0);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, texture.cols - 1);
  const int y1 = std::min(y0 + 1, texture.rows - 1);
  const double ax = x - x0;
  const double ay = y - y0;
  const auto at = [&](int px, int py) {
    const cv::Vec3b& c = texture.at<cv::Vec3b>(py, px);
    return Eigen::Vector3d(c[0], c[1], c[2]);
  };
  return (1 - ay) * ((1 - ax) * at(x0, y0) + ax * at(x1, y0)) + ay * ((1 - ax) * at(x0, y1) + ax * at(x1, y1));
}

}  // namespace

VisibilityBuffer rasterise(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles,
                           const Camera& camera, const Pose& cam_from_world, const RasteriseOptions& options) {
  VisibilityBuffer buffer;
  buffer.width = camera.width;
  buffer.height = camera.height;
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  buffer.depth.assign(pixels, std::numeric_limits<float>::infinity());
  buffer.triangle.assign(pixels, -1);
  buffer.weights.assign(pixels, Eigen::Vector2f::Zero());

  const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
  std::vector<ScreenVertex> screen(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Eigen::Vector3d p = rotation * vertices[i] + cam_from_world.translation;
    if (p.z() < options.near) {
      screen[i] = {0, 0, -1};
      continue;
    }
    const Eigen::Vector2d pixel = camera.pixel_from_normalised(p.head<2>() / p.z());
    screen[i] = {pixel.x(), pixel.y(), p.z()};
  }

  for (std::size_t t = 0; t < triangles.size(); ++t) {
    ScreenVertex a = screen[triangles[t][0]];
    ScreenVertex b = screen[triangles[t][1]];
    ScreenVertex c = screen[triangles[t][2]];
    if (a.z < 0 || b.z < 0 || c.z < 0) continue;
    double area = edge(a, b, c.x, c.y);
    // Image y points down, so a triangle that is counter-clockwise from outside has negative area on the screen.
    if (area == 0 || (options.cull_back_faces && area > 0)) continue;
    const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5)));
    const int x1 = std::min(camera.width - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5)));
    const int y0 = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5)));
    const int y1 = std::min(camera.height - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5)));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double px = x + 0.5;
        const double py = y + 0.5;
        const double wa = edge(b, c, px, py) / area;
        const double wb = edge(c, a, px, py) / area;
        const double wc = 1.0 - wa - wb;
        if (wa < 0 || wb < 0 || wc < 0) continue;
        // Barycentric weights are linear on the screen only after division by depth.
        const double inverse_depth = wa / a.z + wb / b.z + wc / c.z;
        const auto depth = static_cast<float>(1.0 / inverse_depth);
        const std::size_t i = buffer.index(x, y);
        if (depth >= buffer.depth[i]) continue;
        buffer.depth[i] = depth;
        buffer.triangle[i] = static_cast<std::int32_t>(t);
        buffer.weights[i] = {static_cast<float>(wb / b.z / inverse_depth),
                             static_cast<float>(wc / c.z / inverse_depth)};
      }
    }
  }
  return buffer;
}

cv::Mat render(const TriangleMesh& mesh, const cv::Mat& texture, const Camera& camera, const Pose& cam_from_world,
               const ShadeOptions& options) {
  const VisibilityBuffer seen = rasterise(mesh.vertices, mesh.triangles, camera, cam_from_world);
  const std::vector<Eigen::Vector3d> normals =
      mesh.normals.empty() ? vertex_normals(mesh.vertices, mesh.triangles) : mesh.normals;
  const bool textured = !texture.empty() && !mesh.uv_triangles.empty();
  const Eigen::Vector3d background = options.background.reverse();
  cv::Mat image(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t i = seen.index(x, y);
      const int t = seen.triangle[i];
      Eigen::Vector3d bgr = background;
      if (t >= 0) {
        const Eigen::Vector3d w(1.0 - seen.weights[i].x() - seen.weights[i].y(), seen.weights[i].x(),
                                seen.weights[i].y());
        const auto mix = [&](const auto& values, const Eigen::Vector3i& corners, auto zero) {
          auto sum = zero;
          for (int k = 0; k < 3; ++k) sum += w[k] * values[corners[k]].template cast<double>();
          return sum;
        };
        if (textured) {
          bgr = sample_bilinear(texture, mix(mesh.uv, mesh.uv_triangles[t], Eigen::Vector2d(0, 0)));
        } else if (!mesh.colours.empty()) {
          bgr = mix(mesh.colours, mesh.triangles[t], Eigen::Vector3d(0, 0, 0)).reverse();
        } else {
          bgr.setConstant(200);
        }
        if (options.lit) {
          const Eigen::Vector3d n = cam_from_world.rotation * mix(normals, mesh.triangles[t], Eigen::Vector3d(0, 0, 0));
          const Eigen::Vector3d light = Eigen::Vector3d(-0.35, -0.5, -1.0).normalized();
          bgr *= 0.45 + 0.55 * std::max(0.0, n.normalized().dot(light));
        }
      }
      for (int k = 0; k < 3; ++k) image.at<cv::Vec3b>(y, x)[k] = cv::saturate_cast<std::uint8_t>(bgr[k]);
    }
  }
  return image;
}

Pose look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY());
  if (right.norm() < 1e-9) right = Eigen::Vector3d::UnitX();  // straight up or down: any right will do
  right.normalize();
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(0) = right;
  cam_from_world.row(1) = forward.cross(right);
  cam_from_world.row(2) = forward;
  return {Eigen::Quaterniond(cam_from_world), -(cam_from_world * eye)};
}

}  // namespace gyre
