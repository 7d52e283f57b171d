// SPDX-License-Identifier: Apache-2.0
// A painted box in front of a magenta background, photographed from known cameras.
#pragma once

#include "common/mesh/mesh.h"
#include "common/render/rasterise.h"
#include "offload/texture/atlas.h"
#include "offload/texture/photo.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace gyre::scene {

// Adds a box whose six sides are charts in a 3 x 2 layout inside the texture's rectangle [low, low + extent]^2, each
// side divided into cells x cells squares. Vertices are shared between sides.
inline void add_box(TriangleMesh& mesh, const Eigen::Vector3d& centre, const Eigen::Vector3d& half_size, int cells,
                    const Eigen::Vector2d& low, double extent) {
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const int first_vertex = static_cast<int>(mesh.vertices.size());
  const auto vertex = [&](const Eigen::Vector3d& p) {
    for (std::size_t i = first_vertex; i < mesh.vertices.size(); ++i) {
      if ((mesh.vertices[i] - p).norm() < 1e-9) return static_cast<int>(i);
    }
    mesh.vertices.push_back(p);
    return static_cast<int>(mesh.vertices.size()) - 1;
  };
  for (int side = 0; side < 6; ++side) {
    const int axis = side % 3;
    const double sign = side < 3 ? 1.0 : -1.0;
    const Eigen::Vector3d n = sign * axes.col(axis);
    const Eigen::Vector3d u = axes.col((axis + 1) % 3);
    const Eigen::Vector3d v = n.cross(u);
    std::vector<int> grid, grid_uv;
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        const double a = 2.0 * i / cells - 1.0;
        const double b = 2.0 * j / cells - 1.0;
        grid.push_back(vertex(centre + (n + a * u + b * v).cwiseProduct(half_size)));
        const Eigen::Vector2d place((axis + 0.05 + 0.45 * (a + 1)) / 3.0, (side / 3 + 0.05 + 0.45 * (b + 1)) / 2.0);
        grid_uv.push_back(static_cast<int>(mesh.uv.size()));
        mesh.uv.emplace_back(low + extent * place);
      }
    }
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        const int a = j * (cells + 1) + i;
        const int c = a + cells + 1;
        for (const auto& [p, q, r] : {std::tuple(a, a + 1, c + 1), std::tuple(a, c + 1, c)}) {
          mesh.triangles.emplace_back(grid[p], grid[q], grid[r]);
          mesh.uv_triangles.emplace_back(grid_uv[p], grid_uv[q], grid_uv[r]);
        }
      }
    }
  }
}

// A ball with the charts of a box.
inline void add_ball(TriangleMesh& mesh, double radius, int cells) {
  add_box(mesh, Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), cells, {0, 0}, 1.0);
  for (Eigen::Vector3d& v : mesh.vertices) v = radius * v.normalized();
}

// BGR waves through space, without magenta or black.
inline cv::Vec3b colour_at(const Eigen::Vector3d& p) {
  return {cv::saturate_cast<std::uint8_t>(70 + 30 * std::sin(21 * p.x() + 9 * p.z())),
          cv::saturate_cast<std::uint8_t>(140 + 50 * std::sin(17 * p.y() + 5 * p.x())),
          cv::saturate_cast<std::uint8_t>(110 + 40 * std::cos(19 * p.z() - 8 * p.y()))};
}

// A texture of these waves: smooth on the surface, also where charts meet.
inline cv::Mat painting(const TriangleMesh& mesh, int size) {
  const Atlas atlas = map_atlas(mesh.uv, mesh.uv_triangles, size, 4);
  cv::Mat texture(size, size, CV_8UC3, cv::Scalar::all(128));
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const Eigen::Vector3d weights = corner_weights(atlas, i);
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) point += weights[k] * mesh.vertices[mesh.triangles[atlas.triangle[i]][k]];
    texture.at<cv::Vec3b>(static_cast<int>(i) / size, static_cast<int>(i) % size) = colour_at(point);
  }
  return texture;
}

inline Camera camera() {
  Camera c = Camera::from_fov(320, 320, 0.6);
  c.k1 = -0.05;
  return c;
}

inline Photo photograph(const TriangleMesh& mesh, const cv::Mat& texture, const Eigen::Vector3d& eye) {
  Photo photo;
  photo.camera = camera();
  photo.cam_from_world = look_at(eye, Eigen::Vector3d::Zero());
  photo.image = render(mesh, texture, photo.camera, photo.cam_from_world,
                       {.lit = false, .background = Eigen::Vector3d(255, 0, 255)});
  return photo;
}

// A ring of cameras slightly above and one slightly below the middle, and two on the poles.
inline std::vector<Photo> ring(const TriangleMesh& mesh, const cv::Mat& texture, int views, double distance) {
  std::vector<Photo> photos;
  for (int k = 0; k < views; ++k) {
    const double yaw = 2 * M_PI * k / views;
    const double height = k % 2 == 0 ? 0.4 : -0.4;
    photos.push_back(photograph(mesh, texture, distance * Eigen::Vector3d(std::sin(yaw), height, std::cos(yaw))));
  }
  for (const double pole : {1.0, -1.0}) {
    photos.push_back(photograph(mesh, texture, distance * Eigen::Vector3d(0.1, pole, 0.2)));
  }
  for (std::size_t p = 0; p < photos.size(); ++p) photos[p].name = std::to_string(p);
  return photos;
}

}  // namespace gyre::scene
