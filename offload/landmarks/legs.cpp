// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/legs.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include "common/geometry/quantile.h"

namespace gyre {

namespace {

constexpr std::size_t fewest_of_leg = 20;  // nodes that make a foot or a shin

// The widest gap between sorted values inside (-limit, limit): its middle and its width.
std::pair<double, double> widest_gap(std::vector<double> values, double limit) {
  std::sort(values.begin(), values.end());
  double middle = 0, width = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double centre = 0.5 * (values[i - 1] + values[i]), gap = values[i] - values[i - 1];
    if (std::abs(centre) > limit || gap <= width) continue;
    width = gap;
    middle = centre;
  }
  return {middle, width};
}

// Where between the legs the sides part, as an offset towards side 0.
double parting(const Figure& figure, double low_level, double high_level) {
  std::vector<double> sideways;
  for (const Eigen::Vector3d& p : figure.graph.nodes) {
    const double level = figure.level(p), outward = figure.outward(p, 0);
    if (level > low_level && level < high_level && std::abs(outward) < 0.3 * figure.height) sideways.push_back(outward);
  }
  const auto [middle, width] = widest_gap(sideways, 0.09 * figure.height);
  return width > 0.01 * figure.height ? middle : 0.0;
}

std::optional<Foot> measure_foot(const Figure& figure, int side) {
  const SurfaceGraph& graph = figure.graph;
  Foot foot;
  foot.nodes = leg_nodes(figure, side, -0.02, 0.05);
  if (foot.nodes.size() < fewest_of_leg) return std::nullopt;
  for (const int i : foot.nodes) foot.centre += graph.nodes[i] / static_cast<double>(foot.nodes.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const int i : foot.nodes) {
    const Eigen::Vector2d d(graph.nodes[i].x() - foot.centre.x(), graph.nodes[i].z() - foot.centre.z());
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  foot.axis = Eigen::Vector3d(major.x(), 0, major.y());
  if (foot.axis.dot(figure.across()) < 0) foot.axis = -foot.axis;
  // Toes point to the front, more or less; a foot seen in part has an axis of its own.
  if (foot.axis.dot(figure.across()) < 0.6) foot.axis = figure.across();
  std::vector<double> along;
  for (const int i : foot.nodes) along.push_back((graph.nodes[i] - foot.centre).dot(foot.axis));
  const double rear = quantile(along, 0.01), front = quantile(along, 0.99);
  foot.length = front - rear;
  if (foot.length < 0.10 * figure.height || foot.length > 0.25 * figure.height) return std::nullopt;
  foot.centre += 0.5 * (rear + front) * foot.axis;

  std::vector<double> shin;
  for (const int i : leg_nodes(figure, side, 0.075, 0.15))
    shin.push_back((graph.nodes[i] - foot.centre).dot(foot.axis));
  if (shin.size() >= fewest_of_leg)
    foot.shin_offset = -0.5 * (quantile(shin, 0.03) + quantile(shin, 0.97)) / foot.length;
  double rear_top = 0, front_top = 0;
  for (const int i : leg_nodes(figure, side, -0.02, 0.12)) {
    const double at = (graph.nodes[i] - foot.centre).dot(foot.axis) / foot.length;
    if (at > -0.5 && at < -0.25) rear_top = std::max(rear_top, figure.level(graph.nodes[i]));
    if (at < 0.5 && at > 0.25) front_top = std::max(front_top, figure.level(graph.nodes[i]));
  }
  foot.heel_rise = rear_top - front_top;
  return foot;
}

}  // namespace

std::vector<int> leg_nodes(const Figure& figure, int side, double low_level, double high_level) {
  const double edge = parting(figure, std::max(low_level, -0.02), std::max(high_level, 0.05));
  std::vector<int> nodes;
  for (std::size_t i = 0; i < figure.graph.size(); ++i) {
    const Eigen::Vector3d& p = figure.graph.nodes[i];
    const double level = figure.level(p), outward = figure.outward(p, 0) - edge;
    if (level <= low_level || level >= high_level || std::abs(outward) > 0.25 * figure.height) continue;
    if ((side == 0) == (outward > 0)) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

std::array<std::optional<Foot>, 2> find_feet(const Figure& figure) {
  return {measure_foot(figure, 0), measure_foot(figure, 1)};
}

std::optional<Eigen::Vector3d> find_crotch(const Figure& figure, const PointCloud& cloud) {
  constexpr double low = 0.36, high = 0.56, step = 0.004;
  struct Band {
    std::vector<double> sideways, depths;
  };
  std::vector<Band> bands(static_cast<std::size_t>((high - low) / step));
  for (const Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d p = point.cast<double>();
    const double level = figure.level(p), outward = figure.outward(p, 0);
    if (level < low || level >= high || std::abs(outward) > 0.12 * figure.height) continue;
    const auto band = std::min(bands.size() - 1, static_cast<std::size_t>((level - low) / step));
    bands[band].sideways.push_back(outward);
    bands[band].depths.push_back(figure.depth(p));
  }
  // What counts as a gap: more than chance leaves between the points of a band.
  const auto is_open = [&](const Band& band) {
    const double chance = 6 * 0.24 * figure.height / std::max<double>(static_cast<double>(band.sideways.size()), 1);
    return widest_gap(band.sideways, 0.05 * figure.height).second > std::max(0.005 * figure.height, chance);
  };
  int open_below = 0;
  double middle = 0;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    // Both thighs must be there for a gap to lie between them.
    const auto& x = bands[i].sideways;
    const auto on = [&](double sign) {
      return std::count_if(x.begin(), x.end(), [&](double v) { return sign * v > 0; }) >= 5;
    };
    if (on(1) && on(-1) && is_open(bands[i])) {
      ++open_below;
      middle = widest_gap(x, 0.05 * figure.height).first;
      continue;
    }
    // The trunk is closed from here on.
    int closed = 0;
    for (std::size_t k = i; k < std::min(i + 6, bands.size()); ++k)
      closed += bands[k].sideways.size() > 10 && !is_open(bands[k]) ? 1 : 0;
    if (open_below < 8 || closed < 4) continue;
    const double level = low + static_cast<double>(i) * step;
    if (level < 0.40 || level > 0.53) return std::nullopt;
    const auto& depths = bands[i].depths;
    const double depth = 0.5 * (quantile(depths, 0.02) + quantile(depths, 0.98));
    const Eigen::Vector3d place = figure.middle + middle * figure.lateral + depth * figure.across();
    return Eigen::Vector3d(place.x(), figure.floor + level * figure.height, place.z());
  }
  return std::nullopt;
}

}  // namespace gyre
