// SPDX-License-Identifier: Apache-2.0
#include "offload/body/deformation_transfer.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cassert>
#include <cmath>

namespace gyre {

namespace {

constexpr double holding = 1e-9;  // of the mean diagonal: places what no triangle says anything about

// Edges from corner 0, and the normal scaled by the square root of its length, so that a triangle that grows without
// turning has a gradient that is the same in all directions (Sumner and Popovic 2004, eq. 1).
Eigen::Matrix3d frame(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  Eigen::Matrix3d f;
  f.col(0) = b - a;
  f.col(1) = c - a;
  const Eigen::Vector3d normal = f.col(0).cross(f.col(1));
  const double length = normal.norm();
  f.col(2) = length > 0 ? Eigen::Vector3d(normal / std::sqrt(length)) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  return f;
}

struct Triangle {
  Eigen::Vector3i corners;
  std::array<Eigen::Vector3d, 3> source;
  Eigen::Matrix3d source_inverse;  // of the source's frame
  Eigen::Matrix3d pull;            // column k: area times the gradient of corner k's hat function on the target
};

}  // namespace

struct DeformationTransfer::System {
  Eigen::Index vertices = 0;
  std::vector<int> unknown;    // per vertex: its row, -1: held
  std::vector<int> vertex_of;  // per row
  std::vector<Triangle> triangles;
  Eigen::Matrix3d target_from_source;
  double hold = 0.0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
};

DeformationTransfer::DeformationTransfer(std::span<const Eigen::Vector3d> source,
                                         std::span<const Eigen::Vector3d> target,
                                         std::span<const Eigen::Vector3i> triangles, const std::vector<bool>& movable,
                                         const Eigen::Matrix3d& target_from_source)
    : system_(std::make_unique<System>()) {
  assert(source.size() == target.size() && movable.size() == target.size());
  System& s = *system_;
  s.vertices = static_cast<Eigen::Index>(target.size());
  s.target_from_source = target_from_source;
  s.unknown.assign(target.size(), -1);
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (!movable[v]) continue;
    s.unknown[v] = static_cast<int>(s.vertex_of.size());
    s.vertex_of.push_back(static_cast<int>(v));
  }
  std::vector<Eigen::Triplet<double>> entries;
  double trace = 0.0;
  for (const Eigen::Vector3i& t : triangles) {
    if (s.unknown[t[0]] < 0 && s.unknown[t[1]] < 0 && s.unknown[t[2]] < 0) continue;
    const Eigen::Vector3d &a = target[t[0]], &b = target[t[1]], &c = target[t[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double twice_area = normal.norm();
    const Eigen::Matrix3d source_frame = frame(source[t[0]], source[t[1]], source[t[2]]);
    const double shortest = std::min(
        {(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm(), source_frame.col(0).squaredNorm()});
    // Slivers of either surface have no gradient to speak of.
    if (!(twice_area > 1e-6 * shortest) || !(source_frame.col(2).squaredNorm() > 1e-6 * shortest)) continue;
    Triangle triangle{t, {source[t[0]], source[t[1]], source[t[2]]}, source_frame.inverse(), {}};
    const Eigen::Vector3d unit = normal / twice_area;
    triangle.pull.col(0) = 0.5 * unit.cross(c - b);
    triangle.pull.col(1) = 0.5 * unit.cross(a - c);
    triangle.pull.col(2) = 0.5 * unit.cross(b - a);
    const Eigen::Matrix3d stiffness = triangle.pull.transpose() * triangle.pull / (0.5 * twice_area);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const int row = s.unknown[t[i]], column = s.unknown[t[k]];
        if (row < 0 || column < 0 || row < column) continue;
        entries.emplace_back(row, column, stiffness(i, k));
        if (row == column) trace += stiffness(i, k);
      }
    s.triangles.push_back(triangle);
  }
  const auto rows = static_cast<int>(s.vertex_of.size());
  if (rows == 0) return;
  s.hold = holding * std::max(trace / rows, 1e-6);
  for (int row = 0; row < rows; ++row) entries.emplace_back(row, row, s.hold);
  Eigen::SparseMatrix<double> matrix(rows, rows);
  matrix.setFromTriplets(entries.begin(), entries.end());
  s.solver.compute(matrix);
  assert(s.solver.info() == Eigen::Success);
}

DeformationTransfer::DeformationTransfer(DeformationTransfer&&) noexcept = default;
DeformationTransfer& DeformationTransfer::operator=(DeformationTransfer&&) noexcept = default;
DeformationTransfer::~DeformationTransfer() = default;

Eigen::MatrixXd DeformationTransfer::transfer(const Eigen::MatrixXd& source_offsets) const {
  const System& s = *system_;
  assert(source_offsets.rows() == s.vertices && source_offsets.cols() % 3 == 0);
  const auto rows = static_cast<Eigen::Index>(s.vertex_of.size());
  Eigen::MatrixXd offsets = Eigen::MatrixXd::Zero(s.vertices, source_offsets.cols());
  if (rows == 0) return offsets;
  const Eigen::Matrix3d& turn = s.target_from_source;
  // Deformations move parts of a surface: a triangle that stays costs nothing, and columns without motion are skipped.
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(rows, source_offsets.cols());
  for (Eigen::Index column = 0; column < source_offsets.cols(); column += 3) {
    const auto moves = source_offsets.middleCols<3>(column);
    if (moves.isZero(0)) continue;
    for (Eigen::Index row = 0; row < rows; ++row)
      right.block<1, 3>(row, column) = s.hold * moves.row(s.vertex_of[row]) * turn.transpose();
    for (const Triangle& t : s.triangles) {
      const Eigen::Vector3d d0 = moves.row(t.corners[0]), d1 = moves.row(t.corners[1]), d2 = moves.row(t.corners[2]);
      if (d0.isZero(0) && d1.isZero(0) && d2.isZero(0)) continue;
      const Eigen::Matrix3d gradient =
          frame(t.source[0] + d0, t.source[1] + d1, t.source[2] + d2) * t.source_inverse - Eigen::Matrix3d::Identity();
      const Eigen::Matrix3d push = turn * gradient * turn.transpose() * t.pull;
      for (int k = 0; k < 3; ++k)
        if (const int row = s.unknown[t.corners[k]]; row >= 0)
          right.block<1, 3>(row, column) += push.col(k).transpose();
    }
    const Eigen::MatrixX3d solution = s.solver.solve(right.middleCols<3>(column));
    for (Eigen::Index row = 0; row < rows; ++row) offsets.block<1, 3>(s.vertex_of[row], column) = solution.row(row);
  }
  return offsets;
}

std::vector<Eigen::Vector3d> transfer_deformation(std::span<const Eigen::Vector3d> source,
                                                  std::span<const Eigen::Vector3d> deformed_source,
                                                  std::span<const Eigen::Vector3d> target,
                                                  std::span<const Eigen::Vector3i> triangles) {
  assert(deformed_source.size() == source.size());
  const DeformationTransfer solver(source, target, triangles, std::vector<bool>(source.size(), true));
  Eigen::MatrixXd offsets(static_cast<Eigen::Index>(source.size()), 3);
  for (std::size_t v = 0; v < source.size(); ++v)
    offsets.row(static_cast<Eigen::Index>(v)) = (deformed_source[v] - source[v]).transpose();
  const Eigen::MatrixXd moved = solver.transfer(offsets);
  std::vector<Eigen::Vector3d> result(target.begin(), target.end());
  for (std::size_t v = 0; v < result.size(); ++v) result[v] += moved.row(static_cast<Eigen::Index>(v)).transpose();
  return result;
}

}  // namespace gyre
