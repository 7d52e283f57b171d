// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/rotation_averaging.h"

#include "common/geometry/pose.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <limits>
#include <numeric>

namespace gyre {

namespace {

Eigen::Vector3d logarithm(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd turn(q);
  return turn.angle() * turn.axis();
}

// Rotations along the maximum spanning tree (Prim) that grows from `root`.
std::vector<std::optional<Eigen::Quaterniond>> grow_tree(int views, std::span<const RelativeRotation> relative,
                                                         const std::vector<std::vector<std::size_t>>& of_view,
                                                         int root) {
  std::vector<std::optional<Eigen::Quaterniond>> rotations(static_cast<std::size_t>(views));
  rotations[static_cast<std::size_t>(root)] = Eigen::Quaterniond::Identity();
  std::vector<std::size_t> open(of_view[static_cast<std::size_t>(root)]);
  const auto lighter = [&](std::size_t x, std::size_t y) {
    return relative[x].weight != relative[y].weight ? relative[x].weight < relative[y].weight : x > y;
  };
  std::make_heap(open.begin(), open.end(), lighter);
  while (!open.empty()) {
    std::pop_heap(open.begin(), open.end(), lighter);
    const RelativeRotation& r = relative[open.back()];
    open.pop_back();
    auto& a = rotations[static_cast<std::size_t>(r.a)];
    auto& b = rotations[static_cast<std::size_t>(r.b)];
    if (a && b) continue;
    const int found = a ? r.b : r.a;
    if (a) {
      b = r.b_from_a * *a;
    } else {
      a = r.b_from_a.conjugate() * *b;
    }
    for (const std::size_t k : of_view[static_cast<std::size_t>(found)]) {
      open.push_back(k);
      std::push_heap(open.begin(), open.end(), lighter);
    }
  }
  return rotations;
}

std::ptrdiff_t size_of(const std::vector<std::optional<Eigen::Quaterniond>>& rotations) {
  return std::count_if(rotations.begin(), rotations.end(), [](const auto& r) { return r.has_value(); });
}

}  // namespace

RotationAverage average_rotations(int views, std::span<const RelativeRotation> relative,
                                  const RotationAveragingOptions& options) {
  std::vector<std::vector<std::size_t>> of_view(static_cast<std::size_t>(views));
  for (std::size_t k = 0; k < relative.size(); ++k) {
    of_view[static_cast<std::size_t>(relative[k].a)].push_back(k);
    of_view[static_cast<std::size_t>(relative[k].b)].push_back(k);
  }
  RotationAverage average;
  average.cam_from_world.resize(static_cast<std::size_t>(views));
  std::vector<char> tried(static_cast<std::size_t>(views), 0);
  for (int root = 0; root < views; ++root) {
    if (tried[static_cast<std::size_t>(root)] != 0) continue;
    auto tree = grow_tree(views, relative, of_view, root);
    for (std::size_t v = 0; v < tree.size(); ++v)
      if (tree[v]) tried[v] = 1;
    if (size_of(tree) > size_of(average.cam_from_world)) average.cam_from_world = std::move(tree);
  }
  auto& rotations = average.cam_from_world;

  // Unknowns: the views of the group but its first, which stays.
  std::vector<int> unknown_of(static_cast<std::size_t>(views), -1);
  int unknowns = -1;
  for (std::size_t v = 0; v < rotations.size(); ++v)
    if (rotations[v]) unknown_of[v] = unknowns++;
  const auto error_of = [&](const RelativeRotation& r) {
    return logarithm(rotations[static_cast<std::size_t>(r.b)]->conjugate() * r.b_from_a *
                     *rotations[static_cast<std::size_t>(r.a)]);
  };
  // With every rotation R turned to R exp(w), the errors change by w_a - w_b to first order.
  for (int iteration = 0; iteration < options.first_iterations + options.iterations && unknowns > 0; ++iteration) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
    for (const RelativeRotation& r : relative) {
      if (!rotations[static_cast<std::size_t>(r.a)]) continue;
      const Eigen::Vector3d error = error_of(r);
      const double off = error.norm() / options.width;
      const double weight = r.weight * (iteration < options.first_iterations ? 1 / std::max(off, 0.01)
                                                                             : 1 / ((1 + off * off) * (1 + off * off)));
      const int a = unknown_of[static_cast<std::size_t>(r.a)], b = unknown_of[static_cast<std::size_t>(r.b)];
      if (a >= 0) {
        entries.emplace_back(a, a, weight);
        right.row(a) -= weight * error.transpose();
      }
      if (b >= 0) {
        entries.emplace_back(b, b, weight);
        right.row(b) += weight * error.transpose();
      }
      if (a >= 0 && b >= 0) {
        entries.emplace_back(a, b, -weight);
        entries.emplace_back(b, a, -weight);
      }
    }
    Eigen::SparseMatrix<double> normal(unknowns, unknowns);
    normal.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    if (solver.info() != Eigen::Success) break;
    const Eigen::MatrixX3d step = solver.solve(right);
    for (std::size_t v = 0; v < rotations.size(); ++v)
      if (unknown_of[v] >= 0)
        rotations[v] = (*rotations[v] * rotation_about(step.row(unknown_of[v]).transpose())).normalized();
    if (step.rowwise().norm().maxCoeff() < 1e-9 && iteration >= options.first_iterations) break;
  }
  for (const RelativeRotation& r : relative)
    average.disagreement.push_back(rotations[static_cast<std::size_t>(r.a)] ? error_of(r).norm()
                                                                            : std::numeric_limits<double>::infinity());
  return average;
}

}  // namespace gyre
