// SPDX-License-Identifier: Apache-2.0
#include "offload/body/joint_regressor.h"

#include <Eigen/Dense>

namespace gyre {

JointRegressor fit_regressor(const Eigen::MatrixXf& samples, const std::vector<int>& candidates,
                             const Eigen::MatrixXd& wanted) {
  const auto n = static_cast<Eigen::Index>(candidates.size());
  const Eigen::Index rows = 3 * samples.rows();
  // Columns are the candidates relative to the wanted joint, so that a sum of 1 makes A w the error itself.
  Eigen::MatrixXd a(rows, n);
  for (Eigen::Index c = 0; c < n; ++c)
    for (int axis = 0; axis < 3; ++axis)
      a.col(c).segment(axis * samples.rows(), samples.rows()) =
          samples.col(3 * candidates[c] + axis).cast<double>() - wanted.col(axis);
  const Eigen::MatrixXd plain = a.transpose() * a / static_cast<double>(rows);
  const double pull = 1e-3 * plain.trace() / static_cast<double>(n);
  const Eigen::MatrixXd h = plain + pull * Eigen::MatrixXd::Identity(n, n);

  Eigen::VectorXd w = Eigen::VectorXd::Constant(n, 1.0 / static_cast<double>(n));
  Eigen::VectorXd gradient = h * w;
  constexpr int most_steps = 20000;
  for (int step = 0; step < most_steps; ++step) {
    // Move weight from the positive entry with the steepest rise to the entry with the steepest fall.
    Eigen::Index to = 0, from = -1;
    gradient.minCoeff(&to);
    for (Eigen::Index i = 0; i < n; ++i)
      if (w[i] > 0 && (from < 0 || gradient[i] > gradient[from])) from = i;
    const double slope = gradient[from] - gradient[to];
    const double curve = h(from, from) + h(to, to) - 2 * h(from, to);
    if (from == to || slope < 1e-9 * h.diagonal().maxCoeff() || curve <= 0) break;
    const double move = std::min(w[from], slope / curve);
    w[from] -= move;
    w[to] += move;
    gradient += move * (h.col(to) - h.col(from));
  }
  for (double& weight : w)
    if (weight < 1e-3) weight = 0;
  w /= w.sum();

  JointRegressor result;
  result.rms = std::sqrt((a * w).squaredNorm() / static_cast<double>(samples.rows()));
  for (Eigen::Index c = 0; c < n; ++c)
    if (w[c] > 0) result.weights.emplace_back(candidates[c], w[c]);
  return result;
}

std::vector<int> vertices_around(const std::vector<Eigen::Vector3d>& positions, const std::vector<int>& vertices,
                                 const Eigen::Vector3d& joint, std::size_t count) {
  constexpr double reach = 5;
  constexpr std::size_t least_pool = 300;
  std::vector<int> near = vertices;
  std::stable_sort(near.begin(), near.end(), [&](int a, int b) {
    return (positions[a] - joint).squaredNorm() < (positions[b] - joint).squaredNorm();
  });
  if (near.empty()) return {};
  const double farthest = reach * (positions[near[0]] - joint).norm();
  std::size_t pool = std::min(least_pool, near.size());
  while (pool < near.size() && (positions[near[pool]] - joint).norm() < farthest) ++pool;
  near.resize(pool);
  std::vector<double> distance(near.size(), std::numeric_limits<double>::infinity());
  std::vector<int> chosen;
  std::size_t next = 0;
  while (chosen.size() < std::min(count, near.size())) {
    chosen.push_back(near[next]);
    for (std::size_t i = 0; i < near.size(); ++i)
      distance[i] = std::min(distance[i], (positions[near[i]] - positions[chosen.back()]).squaredNorm());
    next = std::max_element(distance.begin(), distance.end()) - distance.begin();
  }
  return chosen;
}

}  // namespace gyre
