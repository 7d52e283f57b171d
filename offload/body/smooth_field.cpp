// SPDX-License-Identifier: Apache-2.0
#include "offload/body/smooth_field.h"

#include <cassert>

namespace gyre {

SmoothField::SmoothField(std::size_t vertices, const std::vector<Eigen::Vector3i>& triangles,
                         const std::vector<bool>& active)
    : place_(vertices, -1) {
  assert(active.size() == vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    if (active[v]) place_[v] = static_cast<int>(count_++);
  std::vector<std::set<int>> neighbours(vertices);
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      neighbours[t[k]].insert(t[(k + 1) % 3]);
      neighbours[t[k]].insert(t[(k + 2) % 3]);
    }
  // Rows of vertices beside the active ones too: there the field must leave zero smoothly.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index row = 0;
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto& around = neighbours[v];
    const bool near =
        place_[v] >= 0 || std::any_of(around.begin(), around.end(), [&](int n) { return place_[n] >= 0; });
    if (!near || around.empty()) continue;
    if (place_[v] >= 0) entries.emplace_back(row, place_[v], 1);
    for (int n : around)
      if (place_[n] >= 0) entries.emplace_back(row, place_[n], -1.0 / static_cast<double>(around.size()));
    ++row;
  }
  Eigen::SparseMatrix<double> laplacian(row, count_);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  squared_ = laplacian.transpose() * laplacian;
}

void SmoothField::factorise(const Eigen::VectorXd& weights, double stiffness) {
  weights_.resize(count_);
  for (std::size_t v = 0; v < place_.size(); ++v)
    if (place_[v] >= 0) weights_[place_[v]] = weights[static_cast<Eigen::Index>(v)];
  Eigen::SparseMatrix<double> system = stiffness * squared_;
  constexpr double held = 1e-9;  // keeps what nothing is known of, and is cut off from the rest, at zero
  for (Eigen::Index i = 0; i < count_; ++i) system.coeffRef(i, i) += weights_[i] + held;
  if (!solver_) {
    solver_ = std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>();
    solver_->analyzePattern(system);
  }
  solver_->factorize(system);
  assert(solver_->info() == Eigen::Success);
}

Eigen::MatrixXd SmoothField::solve(const Eigen::MatrixXd& values) const {
  assert(solver_);
  Eigen::MatrixXd right(count_, 3);
  for (std::size_t v = 0; v < place_.size(); ++v)
    if (place_[v] >= 0) right.row(place_[v]) = weights_[place_[v]] * values.row(static_cast<Eigen::Index>(v));
  const Eigen::MatrixXd solved = solver_->solve(right);
  Eigen::MatrixXd field = Eigen::MatrixXd::Zero(values.rows(), 3);
  for (std::size_t v = 0; v < place_.size(); ++v)
    if (place_[v] >= 0) field.row(static_cast<Eigen::Index>(v)) = solved.row(place_[v]);
  return field;
}

}  // namespace gyre
