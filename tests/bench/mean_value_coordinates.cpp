// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/mean_value_coordinates.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace gyre {

Eigen::VectorXd mean_value_coordinates(std::span<const Eigen::Vector3d> vertices,
                                       std::span<const Eigen::Vector3i> triangles, const Eigen::Vector3d& point) {
  constexpr double tiny = 1e-9;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(vertices.size()));
  std::vector<Eigen::Vector3d> directions(vertices.size());
  std::vector<double> distances(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    directions[v] = vertices[v] - point;
    distances[v] = directions[v].norm();
    if (distances[v] > 0) directions[v] /= distances[v];
  }
  for (const Eigen::Vector3i& t : triangles) {
    for (const int v : t) {
      if (distances[v] > tiny) continue;
      weights.setZero();
      weights[v] = 1.0;
      return weights;
    }
    // The spherical triangle that t covers as seen from the point.
    std::array<double, 3> angle{}, cosine{}, sine{};
    for (int i = 0; i < 3; ++i) {
      const double chord = (directions[t[(i + 1) % 3]] - directions[t[(i + 2) % 3]]).norm();
      angle[i] = 2.0 * std::asin(std::min(1.0, 0.5 * chord));
    }
    const double half = 0.5 * (angle[0] + angle[1] + angle[2]);
    if (std::numbers::pi - half < tiny) {  // the point lies on t
      weights.setZero();
      for (int i = 0; i < 3; ++i)
        weights[t[i]] = std::sin(angle[i]) * distances[t[(i + 1) % 3]] * distances[t[(i + 2) % 3]];
      return weights / weights.sum();
    }
    Eigen::Matrix3d seen;
    seen << directions[t[0]], directions[t[1]], directions[t[2]];
    const double side = seen.determinant() < 0 ? -1.0 : 1.0;
    bool in_plane = false;
    for (int i = 0; i < 3; ++i) {
      const double below = std::sin(angle[(i + 1) % 3]) * std::sin(angle[(i + 2) % 3]);
      cosine[i] = std::clamp(2.0 * std::sin(half) * std::sin(half - angle[i]) / below - 1.0, -1.0, 1.0);
      sine[i] = side * std::sqrt(1.0 - cosine[i] * cosine[i]);
      in_plane = in_plane || !(std::abs(sine[i]) > tiny);
    }
    if (in_plane) continue;  // beside t, which then covers nothing
    for (int i = 0; i < 3; ++i) {
      const int next = (i + 1) % 3, last = (i + 2) % 3;
      weights[t[i]] += (angle[i] - cosine[next] * angle[last] - cosine[last] * angle[next]) /
                       (distances[t[i]] * std::sin(angle[next]) * sine[last]);
    }
  }
  return weights / weights.sum();
}

}  // namespace gyre
