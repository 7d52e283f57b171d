// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/surface_nets.h"

#include "common/parallel/parallel.h"

#include <cmath>

namespace gyre::synthetic {

namespace {

constexpr double steepest = 2.0;  // bound on the field's slope

Eigen::Vector3d gradient(const ScalarField& field, const Eigen::Vector3d& p) {
  constexpr double step = 1e-4;
  Eigen::Vector3d g;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(k);
    g[k] = (field(p + d) - field(p - d)) / (2 * step);
  }
  return g;
}

// Samples of the field and the number of the vertex in each cell.
struct Grid {
  Eigen::Vector3i size;
  Eigen::Vector3d origin;
  double cell = 0.0;
  std::vector<double> values;
  std::vector<int> vertex;

  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * size.y() + y) * size.x() + x; }
  Eigen::Vector3d position(int x, int y, int z) const { return origin + cell * Eigen::Vector3d(x, y, z); }
};

Grid sample(const ScalarField& field, const Eigen::AlignedBox3d& box, double cell) {
  Grid grid;
  grid.cell = cell;
  grid.origin = box.min();
  grid.size = (box.sizes() / cell).array().ceil().cast<int>() + 1;
  grid.values.resize(static_cast<std::size_t>(grid.size.prod()));
  grid.vertex.assign(grid.values.size(), -1);
  // Blocks that the surface cannot reach take the value of their middle: only signs matter there.
  constexpr int block = 5;
  const double reach = steepest * 0.5 * std::sqrt(3.0) * (block + 1) * cell;
  const int blocks_z = (grid.size.z() + block - 1) / block;
  parallel_for(static_cast<std::size_t>(blocks_z), 0, [&](std::size_t layer) {
    const int z0 = static_cast<int>(layer) * block, z1 = std::min(z0 + block, grid.size.z());
    for (int y0 = 0; y0 < grid.size.y(); y0 += block)
      for (int x0 = 0; x0 < grid.size.x(); x0 += block) {
        const int y1 = std::min(y0 + block, grid.size.y()), x1 = std::min(x0 + block, grid.size.x());
        const double middle = field(0.5 * (grid.position(x0, y0, z0) + grid.position(x1 - 1, y1 - 1, z1 - 1)));
        const bool far = std::abs(middle) > reach;
        for (int z = z0; z < z1; ++z)
          for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x)
              grid.values[grid.index(x, y, z)] = far ? middle : field(grid.position(x, y, z));
      }
  });
  return grid;
}

// The mean of the points where the cell's edges cross zero; false when none does.
bool crossing(const Grid& grid, const Eigen::Vector3i& at, Eigen::Vector3d& point) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int corner = 0; corner < 4; ++corner) {
      Eigen::Vector3i a = at;
      a[(axis + 1) % 3] += corner & 1;
      a[(axis + 2) % 3] += corner >> 1;
      Eigen::Vector3i b = a;
      b[axis] += 1;
      const double va = grid.values[grid.index(a.x(), a.y(), a.z())];
      const double vb = grid.values[grid.index(b.x(), b.y(), b.z())];
      if ((va < 0) == (vb < 0)) continue;
      sum += grid.position(a.x(), a.y(), a.z()) + va / (va - vb) * grid.cell * Eigen::Vector3d::Unit(axis);
      ++count;
    }
  }
  if (count > 0) point = sum / count;
  return count > 0;
}

void add_quad(TriangleMesh& mesh, const std::array<int, 4>& q) {
  const auto& v = mesh.vertices;
  if ((v[q[0]] - v[q[2]]).squaredNorm() <= (v[q[1]] - v[q[3]]).squaredNorm()) {
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  } else {
    mesh.triangles.emplace_back(q[1], q[2], q[3]);
    mesh.triangles.emplace_back(q[1], q[3], q[0]);
  }
}

}  // namespace

TriangleMesh polygonise(const ScalarField& field, const Eigen::AlignedBox3d& box, double cell) {
  Grid grid = sample(field, box, cell);
  const Eigen::Vector3i& n = grid.size;
  TriangleMesh mesh;
  for (int z = 0; z + 1 < n.z(); ++z)
    for (int y = 0; y + 1 < n.y(); ++y)
      for (int x = 0; x + 1 < n.x(); ++x) {
        Eigen::Vector3d point;
        if (!crossing(grid, {x, y, z}, point)) continue;
        grid.vertex[grid.index(x, y, z)] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(point);
      }
  mesh.normals.resize(mesh.vertices.size());
  parallel_for(mesh.vertices.size(), 0, [&](std::size_t i) {
    Eigen::Vector3d& p = mesh.vertices[i];
    for (int step = 0; step < 3; ++step) {
      const Eigen::Vector3d g = gradient(field, p);
      // Clamped to half a cell: near a crease the gradient may point past the neighbour.
      const Eigen::Vector3d move = field(p) / std::max(g.squaredNorm(), 1e-6) * g;
      p -= move * std::min(1.0, 0.5 * cell / std::max(move.norm(), 1e-12));
    }
    mesh.normals[i] = gradient(field, p).normalized();
  });
  // An edge of the grid that crosses the surface is shared by four cells: their vertices make a quad.
  for (int z = 1; z + 1 < n.z(); ++z)
    for (int y = 1; y + 1 < n.y(); ++y)
      for (int x = 1; x + 1 < n.x(); ++x)
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3i a(x, y, z), b = a + Eigen::Vector3i::Unit(axis);
          const bool inside = grid.values[grid.index(a.x(), a.y(), a.z())] < 0;
          if (inside == (grid.values[grid.index(b.x(), b.y(), b.z())] < 0)) continue;
          const Eigen::Vector3i u = Eigen::Vector3i::Unit((axis + 1) % 3), v = Eigen::Vector3i::Unit((axis + 2) % 3);
          const auto at = [&](const Eigen::Vector3i& c) { return grid.vertex[grid.index(c.x(), c.y(), c.z())]; };
          std::array<int, 4> quad = {at(a - u - v), at(a - v), at(a), at(a - u)};
          if (!inside) std::swap(quad[1], quad[3]);
          add_quad(mesh, quad);
        }
  return mesh;
}

}  // namespace gyre::synthetic
