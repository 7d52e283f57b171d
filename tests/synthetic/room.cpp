// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/room.h"

#include "tests/synthetic/noise.h"

#include <Eigen/Geometry>
#include <cmath>

namespace gyre::synthetic {

namespace {

using Eigen::Vector3d;

// The parallelogram origin + s u + t v as a grid of at most `cell` metres, facing u x v.
void add_patch(Room& room, const Vector3d& origin, const Vector3d& u, const Vector3d& v, Material material,
               double cell) {
  const int columns = std::max(1, static_cast<int>(std::ceil(u.norm() / cell)));
  const int rows = std::max(1, static_cast<int>(std::ceil(v.norm() / cell)));
  const int first = static_cast<int>(room.mesh.vertices.size());
  const Vector3d normal = u.cross(v).normalized();
  for (int r = 0; r <= rows; ++r)
    for (int c = 0; c <= columns; ++c) {
      room.mesh.vertices.push_back(origin + c * u / columns + r * v / rows);
      room.mesh.normals.push_back(normal);
    }
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const int i = first + r * (columns + 1) + c;
      room.mesh.triangles.emplace_back(i, i + 1, i + columns + 2);
      room.mesh.triangles.emplace_back(i, i + columns + 2, i + columns + 1);
      room.materials.insert(room.materials.end(), 2, material);
    }
}

// A box on the floor, turned by `yaw` about the vertical.
void add_box(Room& room, const Vector3d& foot, const Vector3d& size, double yaw) {
  const Eigen::AngleAxisd turn(yaw, Vector3d::UnitY());
  const Vector3d x = turn * Vector3d(size.x(), 0, 0), y(0, size.y(), 0), z = turn * Vector3d(0, 0, size.z());
  const Vector3d corner = foot - 0.5 * x - 0.5 * z;
  add_patch(room, corner + z, x, y, Material::box, 0.25);
  add_patch(room, corner + x, -x, y, Material::box, 0.25);
  add_patch(room, corner + x + z, -z, y, Material::box, 0.25);
  add_patch(room, corner, z, y, Material::box, 0.25);
  add_patch(room, corner + y + z, x, -z, Material::box, 0.25);
}

}  // namespace

Room make_room(std::uint64_t seed, const RoomSize& size, const Trouble& trouble) {
  Room room;
  const double w = size.half_width, d = size.half_depth, h = size.height;
  constexpr double cell = 0.25;
  add_patch(room, {-w, 0, d}, {2 * w, 0, 0}, {0, 0, -2 * d}, Material::floor, cell);
  add_patch(room, {-w, h, -d}, {2 * w, 0, 0}, {0, 0, 2 * d}, Material::ceiling, cell);
  add_patch(room, {-w, 0, -d}, {2 * w, 0, 0}, {0, h, 0}, Material::wall, cell);
  add_patch(room, {w, 0, d}, {-2 * w, 0, 0}, {0, h, 0}, Material::wall, cell);
  add_patch(room, {-w, 0, d}, {0, 0, -2 * d}, {0, h, 0}, Material::wall, cell);
  add_patch(room, {w, 0, -d}, {0, 0, 2 * d}, {0, h, 0}, Material::wall, cell);
  constexpr double door_half_width = 1.5, door_height = 2.1, plinth = 0.06;
  if (trouble.mirror) {
    add_patch(room, {w - 0.002, plinth, -door_half_width}, {0, 0, 2 * door_half_width}, {0, door_height, 0},
              Material::mirror, cell);
    room.mirror = Eigen::Hyperplane<double, 3>(-Vector3d::UnitX(), Vector3d(w, 0, 0));
  }
  // Against the walls, outside the camera's rings.
  for (int i = 0; i < 9; ++i) {
    std::uint64_t bits = hash(seed, static_cast<std::uint64_t>(300 + i));
    const auto next = [&](double low, double high) {
      bits = hash(bits);
      return low + uniform(bits) * (high - low);
    };
    const double angle = (i + next(0.2, 0.8)) * 2 * M_PI / 9;
    const double radius = next(2.85, 3.05);
    const Vector3d foot(radius * std::sin(angle), 0, radius * std::cos(angle));
    if (trouble.white_half && foot.x() < 0.3) continue;
    if (trouble.mirror && foot.x() > 0 && std::abs(foot.z()) < door_half_width + 0.3) continue;
    add_box(room, foot, {next(0.25, 0.5), next(0.3, 1.3), next(0.25, 0.4)}, angle + next(-0.4, 0.4));
  }
  return room;
}

}  // namespace gyre::synthetic
