// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/figure.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include "common/geometry/quantile.h"

namespace gyre {

namespace {

constexpr std::size_t fewest_nodes = 300;  // that make a person
constexpr std::size_t fewest = 20;         // that make a part of one

// Below 15 % of the height something must be there, else the world's floor counts: legs too dark to be seen.
void measure_height(Figure& figure) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& p : figure.graph.nodes) heights.push_back(p.y());
  const double top = quantile(heights, 0.9998), bottom = quantile(heights, 0.0005);
  figure.floor = bottom > 0.15 * top && top > 0 ? 0.0 : bottom;
  figure.height = std::max(top - figure.floor, 0.01);
}

std::vector<Eigen::Vector3d> between(const Figure& figure, double low, double high) {
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& p : figure.graph.nodes)
    if (figure.level(p) > low && figure.level(p) < high) kept.push_back(p);
  return kept;
}

// The axis of largest horizontal spread of the upper body, which has the arms.
bool measure_axis(Figure& figure) {
  const std::vector<Eigen::Vector3d> upper = between(figure, 0.4, 0.85);
  if (upper.size() < fewest) return false;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : upper) centre += Eigen::Vector2d(p.x(), p.z());
  centre /= static_cast<double>(upper.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : upper) {
    const Eigen::Vector2d d = Eigen::Vector2d(p.x(), p.z()) - centre;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  figure.lateral = Eigen::Vector3d(major.x(), 0, major.y());
  figure.elongation = std::sqrt(axes.eigenvalues()[1] / std::max(axes.eigenvalues()[0], 1e-12));
  return true;
}

// Sideways the middle of the head, which no missing arm can shift; across the axis the middle of the trunk.
void measure_middle(Figure& figure) {
  std::vector<Eigen::Vector3d> head = between(figure, 0.88, 1.1), trunk = between(figure, 0.5, 0.75);
  if (trunk.size() < fewest) trunk = between(figure, 0.4, 0.85);
  if (head.size() < fewest) head = trunk;
  std::vector<double> sideways, depths;
  for (const Eigen::Vector3d& p : head) sideways.push_back(p.dot(figure.lateral));
  const double side = 0.5 * (quantile(sideways, 0.02) + quantile(sideways, 0.98));
  const Eigen::Vector3d across = figure.across();
  for (const Eigen::Vector3d& p : trunk)
    if (std::abs(p.dot(figure.lateral) - side) < 0.08 * figure.height) depths.push_back(p.dot(across));
  const double depth = 0.5 * (quantile(depths, 0.02) + quantile(depths, 0.98));
  figure.middle = side * figure.lateral + depth * across + figure.floor * Eigen::Vector3d::UnitY();
}

}  // namespace

std::optional<Figure> measure_figure(const PointCloud& cloud) {
  Figure figure;
  figure.graph = make_surface_graph(cloud);
  if (figure.graph.size() < fewest_nodes) return std::nullopt;
  measure_height(figure);
  if (!measure_axis(figure)) return std::nullopt;
  measure_middle(figure);
  return figure;
}

}  // namespace gyre
