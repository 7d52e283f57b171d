// SPDX-License-Identifier: Apache-2.0
#include "offload/body/smooth_correction.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <cassert>

namespace gyre {

namespace {

constexpr double tolerance = 1e-6;  // metres a condition may be missed by before it counts as active

// Minimises m^T (S + c) m / 2 - amounts^T m with m >= 0 where a condition is one-sided: the multipliers of the
// conditions (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23, for a quadratic form).
Eigen::VectorXd multipliers(Eigen::MatrixXd s, std::span<const MotionCondition> conditions) {
  const auto count = static_cast<Eigen::Index>(conditions.size());
  const double typical = s.diagonal().mean();
  Eigen::VectorXd amounts(count), m = Eigen::VectorXd::Zero(count);
  std::vector<Eigen::Index> active;
  for (Eigen::Index i = 0; i < count; ++i) {
    amounts[i] = conditions[i].amount;
    s(i, i) += typical * conditions[i].softness;
    if (conditions[i].exact) active.push_back(i);
  }
  // Solves for the active ones, and lets go of those that would pull, one bound at a time.
  const auto settle = [&] {
    while (!active.empty()) {
      const Eigen::VectorXd right = amounts(active);
      const Eigen::VectorXd wanted = Eigen::MatrixXd(s(active, active)).ldlt().solve(right);
      double step = 1.0;
      for (std::size_t k = 0; k < active.size(); ++k) {
        const double now = m[active[k]], next = wanted[static_cast<Eigen::Index>(k)];
        if (!conditions[active[k]].exact && next < 0) step = std::min(step, now / (now - next));
      }
      std::vector<Eigen::Index> kept;
      for (std::size_t k = 0; k < active.size(); ++k) {
        const Eigen::Index i = active[k];
        const double next = wanted[static_cast<Eigen::Index>(k)];
        const bool bound = !conditions[i].exact && next < 0 && m[i] + step * (next - m[i]) <= 1e-15 * std::abs(next);
        m[i] = bound ? 0.0 : m[i] + step * (next - m[i]);
        if (!bound) kept.push_back(i);
      }
      active = std::move(kept);
      if (step == 1.0) return;
    }
  };
  settle();
  for (Eigen::Index added = 0; added < 3 * count; ++added) {
    const Eigen::VectorXd missing = amounts - s * m;
    Eigen::Index worst = -1;
    for (Eigen::Index i = 0; i < count; ++i)
      if (!conditions[i].exact && m[i] == 0 && missing[i] > tolerance && (worst < 0 || missing[i] > missing[worst]))
        worst = i;
    if (worst < 0) break;
    active.push_back(worst);
    settle();
  }
  return m;
}

}  // namespace

Eigen::SparseMatrix<double> cotangent_laplacian(std::span<const Eigen::Vector3d> vertices,
                                                std::span<const Eigen::Vector3i> triangles, Eigen::VectorXd& areas) {
  const auto n = static_cast<Eigen::Index>(vertices.size());
  areas = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Triplet<double>> entries;
  for (const Eigen::Vector3i& t : triangles) {
    const double area = 0.5 * (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm();
    if (!(area > 1e-14)) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      areas[a] += area / 3.0;
      const double half_cotangent = (vertices[a] - vertices[c]).dot(vertices[b] - vertices[c]) / (4.0 * area);
      entries.emplace_back(a, b, -half_cotangent);
      entries.emplace_back(b, a, -half_cotangent);
      entries.emplace_back(a, a, half_cotangent);
      entries.emplace_back(b, b, half_cotangent);
    }
  }
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian;
}

SmoothCorrection::SmoothCorrection(std::span<const Eigen::Vector3d> vertices,
                                   std::span<const Eigen::Vector3i> triangles, std::vector<int> movable,
                                   std::span<const int> touchable)
    : movable_(std::move(movable)), column_(vertices.size(), -1), row_(vertices.size(), -1) {
  for (std::size_t i = 0; i < movable_.size(); ++i) row_[movable_[i]] = static_cast<int>(i);
  int columns = 0;
  for (const int v : touchable)
    if (row_[v] >= 0 && column_[v] < 0) column_[v] = columns++;
  const auto rows = static_cast<Eigen::Index>(movable_.size());
  green_.resize(rows, columns);
  if (rows == 0 || columns == 0) return;

  Eigen::VectorXd areas;
  const Eigen::SparseMatrix<double> laplacian = cotangent_laplacian(vertices, triangles, areas);
  std::vector<Eigen::Triplet<double>> picks;
  for (Eigen::Index i = 0; i < rows; ++i) picks.emplace_back(movable_[i], i, 1.0);
  Eigen::SparseMatrix<double> pick(laplacian.cols(), rows);
  pick.setFromTriplets(picks.begin(), picks.end());
  const Eigen::SparseMatrix<double> curvature = laplacian * pick;
  const double least_area = 1e-3 * areas.sum() / static_cast<double>(std::max<Eigen::Index>(1, areas.size()));
  const Eigen::VectorXd weights = areas.cwiseMax(least_area).cwiseInverse();
  Eigen::SparseMatrix<double> bending = curvature.transpose() * weights.asDiagonal() * curvature;
  // A vertex that bending does not hold, in a piece without an end, stays.
  double trace = 0.0;
  for (Eigen::Index i = 0; i < rows; ++i) trace += bending.coeff(i, i);
  for (Eigen::Index i = 0; i < rows; ++i) bending.coeffRef(i, i) += 1e-9 * trace / static_cast<double>(rows);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(bending);
  assert(solver.info() == Eigen::Success);
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(rows, columns);
  for (std::size_t v = 0; v < column_.size(); ++v)
    if (column_[v] >= 0) unit(row_[v], column_[v]) = 1.0;
  green_ = solver.solve(unit);
}

std::vector<Eigen::Vector3d> SmoothCorrection::solve(std::span<const MotionCondition> conditions) const {
  std::vector<Eigen::Vector3d> moved(movable_.size(), Eigen::Vector3d::Zero());
  const auto count = static_cast<Eigen::Index>(conditions.size());
  const bool idle =
      std::none_of(conditions.begin(), conditions.end(), [](const auto& c) { return c.exact || c.amount > 0; });
  if (idle || green_.cols() == 0) return moved;
  Eigen::MatrixXd s(count, count);
  const auto entry = [&](const MotionCondition& a, const MotionCondition& b) {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k) {
        if (a.weights[i] == 0 || b.weights[k] == 0) continue;
        const int row = row_[a.vertices[i]], column = column_[b.vertices[k]];
        if (row >= 0 && column >= 0) sum += a.weights[i] * b.weights[k] * green_(row, column);
      }
    return sum * a.direction.dot(b.direction);
  };
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index k = 0; k <= i; ++k) s(i, k) = s(k, i) = entry(conditions[i], conditions[k]);
  if (!(s.diagonal().mean() > 0)) return moved;
  const Eigen::VectorXd m = multipliers(s, conditions);
  Eigen::MatrixX3d forces = Eigen::MatrixX3d::Zero(green_.cols(), 3);
  for (Eigen::Index i = 0; i < count; ++i)
    for (int k = 0; k < 4; ++k)
      if (const int column = conditions[i].weights[k] != 0 ? column_[conditions[i].vertices[k]] : -1; column >= 0)
        forces.row(column) += m[i] * conditions[i].weights[k] * conditions[i].direction.transpose();
  const Eigen::MatrixX3d solution = green_ * forces;
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = solution.row(static_cast<Eigen::Index>(i)).transpose();
  return moved;
}

}  // namespace gyre
