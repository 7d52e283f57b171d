// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/limb.h"

#include "common/geometry/quantile.h"
#include "offload/landmarks/squared.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gyre {

namespace {

constexpr std::size_t fewest_of_arm = 12;  // nodes that make an arm

// Nodes of the trunk that distances are measured from.
std::vector<int> trunk_nodes(const Figure& figure) {
  std::vector<int> trunk;
  for (const double margin : {0.0, 0.06}) {
    for (std::size_t i = 0; i < figure.graph.size(); ++i) {
      const Eigen::Vector3d& p = figure.graph.nodes[i];
      const double level = figure.level(p);
      if (level > 0.60 - margin && level < 0.66 + margin && std::abs(figure.outward(p, 0)) < 0.07 * figure.height)
        trunk.push_back(static_cast<int>(i));
    }
    if (trunk.size() >= fewest_of_arm) break;
  }
  return trunk;
}

// The mean of the `count` nodes that lie farthest, so that one stray node does not decide.
Eigen::Vector3d mean_of_farthest(const SurfaceGraph& graph, std::vector<std::pair<double, int>>& by_distance,
                                 std::size_t count) {
  count = std::min(count, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count), by_distance.end(),
                    std::greater<>());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) sum += graph.nodes[by_distance[i].second];
  return sum / static_cast<double>(count);
}

std::vector<LimbSection> make_sections(const Figure& figure, int side, int tip, const Eigen::Vector3d& fingertip) {
  const SurfaceGraph& graph = figure.graph;
  const double step = 0.0075 * figure.height, longest = 0.50 * figure.height, widest = 0.13 * figure.height;
  const int source[] = {tip};
  const std::vector<double> distance = geodesic_distances(graph, source, longest);
  std::vector<std::vector<int>> bands(static_cast<std::size_t>(longest / step) + 1);
  for (std::size_t i = 0; i < graph.size(); ++i)
    if (std::isfinite(distance[i]) && figure.outward(graph.nodes[i], side) > 0.03 * figure.height)
      bands[static_cast<std::size_t>(distance[i] / step)].push_back(static_cast<int>(i));

  std::vector<LimbSection> sections;
  Eigen::Vector3d before = fingertip;
  double along = 0;
  int empty = 0;
  for (const std::vector<int>& band : bands) {
    LimbSection section;
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const int i : band) {
      // A hand that rests on the thigh leads the distances over to it.
      if ((graph.nodes[i] - before).norm() > 0.08 * figure.height) continue;
      section.nodes.push_back(i);
      low = low.cwiseMin(graph.nodes[i]);
      high = high.cwiseMax(graph.nodes[i]);
    }
    if (section.nodes.size() < 3) {
      if (++empty > 14) break;  // a hole of a tenth of the height ends the arm
      continue;
    }
    empty = 0;
    section.centre = 0.5 * (low + high);
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const int i : section.nodes) {
      const Eigen::Vector3d d = graph.nodes[i] - section.centre;
      spread += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
    const Eigen::Vector3d major = axes.eigenvectors().col(2);
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const int i : section.nodes) {
      least = std::min(least, graph.nodes[i].dot(major));
      most = std::max(most, graph.nodes[i].dot(major));
    }
    section.width = most - least;
    along += (section.centre - before).norm();
    section.along = along;
    before = section.centre;
    const bool reached_trunk = section.width > widest && along > 0.30 * figure.height;
    if (reached_trunk) break;
    sections.push_back(std::move(section));
  }
  return sections;
}

// Least-squares line through centres [first, last): sum of squared distances.
double line_misfit(const std::vector<LimbSection>& sections, std::size_t first, std::size_t last) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(last - first);
  for (std::size_t i = first; i < last; ++i) mean += sections[i].centre / count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = first; i < last; ++i) {
    const Eigen::Vector3d d = sections[i].centre - mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread, Eigen::EigenvaluesOnly);
  return axes.eigenvalues()[0] + axes.eigenvalues()[1];
}

// Mean and standard deviation of a distance whose candidates have the given costs (minus logarithms of likelihoods).
std::optional<Along> weigh(const std::vector<std::pair<double, double>>& candidates) {
  if (candidates.empty()) return std::nullopt;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [distance, cost] : candidates) least = std::min(least, cost);
  double sum = 0, mean = 0, square = 0;
  for (const auto& [distance, cost] : candidates) {
    const double weight = std::exp(least - cost);
    sum += weight;
    mean += weight * distance;
    square += weight * distance * distance;
  }
  mean /= sum;
  return Along{mean, std::sqrt(std::max(square / sum - mean * mean, 1e-6))};
}

}  // namespace

tl::expected<Arm, std::string> trace_arm(const Figure& figure, int side) {
  const SurfaceGraph& graph = figure.graph;
  const std::vector<int> trunk = trunk_nodes(figure);
  if (trunk.size() < fewest_of_arm) return tl::unexpected(std::string("the cloud has no trunk to start from"));
  const std::vector<double> distance = geodesic_distances(graph, trunk, figure.height);
  std::vector<std::pair<double, int>> outside;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    const Eigen::Vector3d& p = graph.nodes[i];
    const double level = figure.level(p), outward = figure.outward(p, side);
    if (outward > 0.14 * figure.height && outward < 0.60 * figure.height && level > 0.22 && level < 0.95 &&
        std::isfinite(distance[i]))
      outside.emplace_back(distance[i], static_cast<int>(i));
  }
  if (outside.size() < fewest_of_arm)
    return tl::unexpected(std::string("no arm stands out from the trunk on this side"));
  Arm arm;
  arm.fingertip = mean_of_farthest(graph, outside, 3);
  const auto [farthest, tip] = outside.front();
  if (farthest < 0.36 * figure.height) return tl::unexpected(std::string("the cloud has no hand on this side"));
  arm.sections = make_sections(figure, side, tip, arm.fingertip);
  if (arm.sections.size() < 5) return tl::unexpected(std::string("too little of the arm is in the cloud"));
  return arm;
}

Eigen::Vector3d centre_at(const Arm& arm, double along) {
  const auto after = std::find_if(arm.sections.begin(), arm.sections.end(),
                                  [&](const LimbSection& section) { return section.along >= along; });
  if (after == arm.sections.end()) return arm.sections.back().centre;
  if (after == arm.sections.begin()) return after->centre;
  const LimbSection &a = *(after - 1), &b = *after;
  const double share = (along - a.along) / std::max(b.along - a.along, 1e-9);
  return a.centre + share * (b.centre - a.centre);
}

Eigen::Vector3d direction_at(const Arm& arm, double along) {
  constexpr double span = 0.03;  // metres to both sides
  const Eigen::Vector3d way = centre_at(arm, along + span) - centre_at(arm, along - span);
  return way.norm() > 1e-6 ? way.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitY());
}

std::optional<Along> find_wrist(const Arm& arm, double stature) {
  std::vector<double> widths;
  for (const LimbSection& s : arm.sections)
    if (s.along > 0.05 * stature && s.along < 0.16 * stature) widths.push_back(s.width);
  if (widths.size() < 4) return std::nullopt;
  const double usual = quantile(widths, 0.5);
  std::vector<std::pair<double, double>> candidates;
  for (const LimbSection& s : arm.sections)
    if (s.along > 0.08 * stature && s.along < 0.145 * stature)
      candidates.emplace_back(
          s.along, 0.5 * squared((s.along / stature - 0.108) / 0.010) + 4.0 * std::max(s.width / usual - 0.6, 0.0));
  return weigh(candidates);
}

std::optional<Along> find_elbow(const Arm& arm, double stature) {
  const auto index_at = [&](double share) {
    return static_cast<std::size_t>(std::find_if(arm.sections.begin(), arm.sections.end(),
                                                 [&](const LimbSection& s) { return s.along >= share * stature; }) -
                                    arm.sections.begin());
  };
  const std::size_t first = index_at(0.12), last = index_at(0.39);
  if (last < first + 10 || index_at(0.30) >= arm.sections.size()) return std::nullopt;
  constexpr double noise = 0.006;  // metres, of a centre
  std::vector<std::pair<double, double>> candidates;
  for (std::size_t i = index_at(0.225); i < std::min(index_at(0.315), last); ++i) {
    if (i < first + 3 || i + 3 > last) continue;
    const double misfit = line_misfit(arm.sections, first, i + 1) + line_misfit(arm.sections, i, last);
    candidates.emplace_back(arm.sections[i].along, 0.5 * squared((arm.sections[i].along / stature - 0.268) / 0.014) +
                                                       0.5 * misfit / squared(noise) / 3);
  }
  return weigh(candidates);
}

}  // namespace gyre
