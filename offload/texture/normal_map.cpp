// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/normal_map.h"

#include "common/mesh/closest_point.h"
#include "common/mesh/tangents.h"
#include "common/parallel/parallel.h"
#include "offload/texture/atlas.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <vector>

namespace gyre {

namespace {

// A point of the cloud and where it stands on the mesh.
struct Foot {
  Eigen::Vector3d point, foot;
  double trust = 0;  // inverse variance along the normal
};

// Feet by the cube they lie in, for searches within one cube's side.
class FootGrid {
 public:
  FootGrid(std::vector<Foot> feet, double side) : feet_(std::move(feet)), side_(side) {
    for (std::size_t i = 0; i < feet_.size(); ++i) cells_[key(cell(feet_[i].foot))].push_back(i);
  }

  // Feet no further than `radius` from `centre`.
  std::vector<const Foot*> around(const Eigen::Vector3d& centre, double radius) const {
    std::vector<const Foot*> found;
    const Eigen::Vector3i low = cell(centre.array() - radius), high = cell(centre.array() + radius);
    for (int x = low.x(); x <= high.x(); ++x) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int z = low.z(); z <= high.z(); ++z) {
          const auto at = cells_.find(key({x, y, z}));
          if (at == cells_.end()) continue;
          for (const std::size_t i : at->second) {
            if ((feet_[i].foot - centre).squaredNorm() <= radius * radius) found.push_back(&feet_[i]);
          }
        }
      }
    }
    return found;
  }

 private:
  Eigen::Vector3i cell(const Eigen::Vector3d& p) const { return (p / side_).array().floor().cast<int>(); }
  static std::uint64_t key(const Eigen::Vector3i& c) {
    constexpr std::uint64_t mask = (1U << 21U) - 1;
    return ((static_cast<std::uint64_t>(c.x()) & mask) << 42U) | ((static_cast<std::uint64_t>(c.y()) & mask) << 21U) |
           (static_cast<std::uint64_t>(c.z()) & mask);
  }

  std::vector<Foot> feet_;
  double side_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

std::vector<Foot> feet_of(const TriangleMesh& mesh, const PointCloud& cloud, const NormalMapOptions& options,
                          int threads) {
  const ClosestPoint surface(mesh);
  std::vector<Foot> all(cloud.points.size());
  parallel_for(all.size(), threads, [&](std::size_t i) {
    const Eigen::Vector3d point = cloud.points[i].cast<double>();
    const auto on = surface.nearest(point, options.most_offset);
    if (!on) return;
    // The far side of something thin is nobody's relief.
    if (!cloud.normals.empty() && cloud.normals[i].cast<double>().dot(on->normal) < 0.5) return;
    const double deviation =
        cloud.deviation.empty() ? options.deviation : std::max(0.0002, static_cast<double>(cloud.deviation[i]));
    all[i] = {point, on->position, 1.0 / (deviation * deviation)};
  });
  std::erase_if(all, [](const Foot& f) { return f.trust <= 0; });
  return all;
}

// Slopes along `u` and `v` of the plane through the points, heights counted along u x v from `at`.
Eigen::Vector2d slopes(const std::vector<const Foot*>& near, const Eigen::Vector3d& at, const Eigen::Vector3d& u,
                       const Eigen::Vector3d& v, const NormalMapOptions& options, bool& any) {
  const Eigen::Vector3d normal = u.cross(v);
  const double sigma = 0.5 * options.reach;
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();  // height, slopes
  for (const bool robust : {false, true}) {
    Eigen::Matrix3d matrix = Eigen::Vector3d(1e-6, 1, 1).asDiagonal();
    matrix *= options.alike / (options.slope * options.slope);
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Foot* f : near) {
      const double away = (f->foot - at).squaredNorm();
      if (away > options.reach * options.reach) continue;
      any = true;
      const Eigen::Vector3d by = f->point - at;
      const Eigen::Vector3d row(1.0, u.dot(by), v.dot(by));
      const double height = normal.dot(by);
      double weight = f->trust * std::exp(-0.5 * away / (sigma * sigma));
      if (robust) {
        const double off = height - plane.dot(row);
        weight /= 1.0 + off * off * f->trust;  // Cauchy
      }
      matrix += weight * row * row.transpose();
      right += weight * height * row;
    }
    if (!any) return Eigen::Vector2d::Zero();
    plane = matrix.inverse() * right;
  }
  return plane.tail<2>();
}

// The smooth frame of a texel.
struct Frame {
  Eigen::Vector3d normal, tangent, bitangent;
};

Frame frame_at(const TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& normals,
               const std::array<Eigen::Vector4f, 3>& tangents, int triangle, const Eigen::Vector3d& weights) {
  Frame frame{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int k = 0; k < 3; ++k) {
    frame.normal += weights[k] * normals[mesh.triangles[triangle][k]];
    frame.tangent += weights[k] * tangents[static_cast<std::size_t>(k)].head<3>().cast<double>();
  }
  frame.normal.normalize();
  frame.tangent = (frame.tangent - frame.normal.dot(frame.tangent) * frame.normal).normalized();
  frame.bitangent = double{tangents[0][3]} * frame.normal.cross(frame.tangent);
  return frame;
}

cv::Vec3b encoded(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = normal.normalized();
  const auto byte = [](double x) { return cv::saturate_cast<std::uint8_t>(127.5 + 127.5 * x); };
  return {byte(n.z()), byte(n.y()), byte(n.x())};
}

// Texels of every triangle.
std::vector<std::vector<std::int32_t>> by_triangle(const Atlas& atlas, std::size_t triangles) {
  std::vector<std::vector<std::int32_t>> texels(triangles);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] >= 0) texels[atlas.triangle[i]].push_back(static_cast<std::int32_t>(i));
  }
  return texels;
}

}  // namespace

NormalMap bake_normal_map(const TriangleMesh& mesh, const PointCloud& cloud, std::span<const std::uint8_t> skip,
                          const NormalMapOptions& options, int threads) {
  constexpr int rim = 4;  // texels, for the smaller copies that renderers make
  const Atlas atlas = map_atlas(mesh.uv, mesh.uv_triangles, options.size, rim);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh.vertices, mesh.triangles);
  const auto tangents = corner_tangents(mesh, normals);
  const FootGrid grid(feet_of(mesh, cloud, options, threads), options.reach);
  const auto texels = by_triangle(atlas, mesh.triangles.size());
  NormalMap map{cv::Mat(options.size, options.size, CV_8UC3, encoded(Eigen::Vector3d::UnitZ())), 0.0};
  std::vector<std::size_t> covered(mesh.triangles.size(), 0);
  parallel_for(mesh.triangles.size(), threads, [&](std::size_t t) {
    if (texels[t].empty() || skip[t] != 0) return;
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::int32_t i : texels[t]) {
      points.push_back(texel_point(mesh, atlas, static_cast<std::size_t>(i)));
      middle += points.back() / static_cast<double>(texels[t].size());
    }
    double extent = 0;
    for (const Eigen::Vector3d& p : points) extent = std::max(extent, (p - middle).norm());
    const std::vector<const Foot*> near = grid.around(middle, extent + options.reach);
    if (near.empty()) return;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const std::int32_t i = texels[t][k];
      const Eigen::Vector3d weights = corner_weights(atlas, static_cast<std::size_t>(i)).cwiseMax(0.0);
      const Frame frame = frame_at(mesh, normals, tangents[t], static_cast<int>(t), weights / weights.sum());
      const Eigen::Vector3d across = frame.normal.cross(frame.tangent);
      bool any = false;
      const Eigen::Vector2d slope = slopes(near, points[k], frame.tangent, across, options, any);
      if (!any) continue;
      ++covered[t];
      const Eigen::Vector3d seen = frame.normal - slope[0] * frame.tangent - slope[1] * across;
      map.picture.at<cv::Vec3b>(i / atlas.size, i % atlas.size) =
          encoded({seen.dot(frame.tangent), seen.dot(frame.bitangent), seen.dot(frame.normal)});
    }
  });
  std::size_t surface = 0, seen = 0;
  for (std::size_t t = 0; t < texels.size(); ++t) {
    surface += texels[t].size();
    seen += covered[t];
  }
  if (surface > 0) map.covered = static_cast<double>(seen) / static_cast<double>(surface);
  return map;
}

}  // namespace gyre
