// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/cloud_alignment.h"

#include "common/geometry/quantile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace gyre {

namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr std::size_t min_points = 50;

Points evenly(std::span<const Eigen::Vector3d> all, std::size_t most) {
  Points some;
  const std::size_t count = std::min(all.size(), most);
  for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

// Height that one point in fifty exceeds: the very highest may be false.
double top_of(const Points& points) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& p : points) heights.push_back(p.y());
  const auto nth = heights.begin() + static_cast<std::ptrdiff_t>(49 * heights.size() / 50);
  std::nth_element(heights.begin(), nth, heights.end());
  return *nth;
}

Points above(const Points& points, double height) {
  Points high;
  for (const Eigen::Vector3d& p : points)
    if (p.y() > height) high.push_back(p);
  return high;
}

// Median place of points, their top instead of their height.
Eigen::Vector3d below_top(const Points& points, double top) {
  std::vector<double> x, z;
  for (const Eigen::Vector3d& p : points) {
    x.push_back(p.x());
    z.push_back(p.z());
  }
  return {median(std::move(x)), top, median(std::move(z))};
}

struct Nearest {
  std::size_t index = 0;
  double distance = std::numeric_limits<double>::infinity();
};

Nearest nearest(const Points& points, const Eigen::Vector3d& to) {
  Nearest best;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = (points[i] - to).squaredNorm();
    if (distance < best.distance) best = {i, distance};
  }
  best.distance = std::sqrt(best.distance);
  return best;
}

Points moved(const Points& points, const Similarity& by) {
  Points result;
  result.reserve(points.size());
  for (const Eigen::Vector3d& p : points) result.push_back(by * p);
  return result;
}

// Mean distance to the other cloud's nearest point, at most reach, of `from` near the top.
double one_way(const Points& from, const Points& to, double lowest, double reach) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Eigen::Vector3d& p : from) {
    if (p.y() < lowest) continue;
    sum += std::min(reach, nearest(to, p).distance);
    ++count;
  }
  return count == 0 ? reach : sum / static_cast<double>(count);
}

double misfit(const Points& a, const Points& b_in_a, double lowest, double reach) {
  return one_way(a, b_in_a, lowest, reach) + one_way(b_in_a, a, lowest, reach);
}

struct Candidate {
  Similarity a_from_b;
  double misfit = 0.0;
};

Similarity refined(const Points& a, const Points& b, Similarity a_from_b, double lowest,
                   const CloudAlignmentOptions& options) {
  for (int i = 0; i < options.iterations; ++i) {
    // The gate closes in the first half from the reach to a fifth of it.
    const double gate = options.reach * std::max(0.2, 1.0 - 1.6 * i / options.iterations);
    const Points b_in_a = moved(b, a_from_b);
    Points in_a, in_b;
    for (std::size_t k = 0; k < b.size(); ++k) {
      if (b_in_a[k].y() < lowest) continue;
      const Nearest match = nearest(a, b_in_a[k]);
      if (match.distance > gate) continue;
      in_a.push_back(a[match.index]);
      in_b.push_back(b[k]);
    }
    for (const Eigen::Vector3d& p : a) {
      if (p.y() < lowest) continue;
      const Nearest match = nearest(b_in_a, p);
      if (match.distance > gate) continue;
      in_a.push_back(p);
      in_b.push_back(b[match.index]);
    }
    const auto better = align_points(in_a, in_b);
    if (!better) break;
    a_from_b = *better;
  }
  return a_from_b;
}

}  // namespace

std::optional<CloudAlignment> align_clouds(std::span<const Eigen::Vector3d> all_a,
                                           std::span<const Eigen::Vector3d> all_b,
                                           const CloudAlignmentOptions& options) {
  if (all_a.size() < min_points || all_b.size() < min_points) return std::nullopt;
  const double top_a = top_of({all_a.begin(), all_a.end()}), top_b = top_of({all_b.begin(), all_b.end()});
  const double lowest = top_a - options.depth;
  // Around what is compared, so that its lower end has counterparts too.
  const Points a = evenly(above({all_a.begin(), all_a.end()}, lowest - options.reach), options.most_points);
  if (a.size() < min_points) return std::nullopt;
  const Eigen::Vector3d place_a = below_top(a, top_a);

  std::vector<Candidate> candidates;
  for (double scale = options.least_scale; scale <= options.largest_scale; scale *= options.scale_step) {
    const Points b = evenly(above({all_b.begin(), all_b.end()}, top_b - (options.depth + options.reach) / scale),
                            options.most_points);
    if (b.size() < min_points) continue;
    // A coarse look is enough to rank; the finer one follows.
    const Points few_a = evenly(a, 250), few_b = evenly(b, 250);
    const Eigen::Vector3d place_b = below_top(b, top_b);
    for (int h = 0; h < options.headings; ++h) {
      Similarity a_from_b;
      a_from_b.scale = scale;
      a_from_b.rotation = Eigen::AngleAxisd(2 * std::numbers::pi * h / options.headings, Eigen::Vector3d::UnitY());
      a_from_b.translation = place_a - scale * (a_from_b.rotation * place_b);
      candidates.push_back({a_from_b, misfit(few_a, moved(few_b, a_from_b), lowest, options.reach)});
    }
  }
  const auto better = [](const Candidate& x, const Candidate& y) { return x.misfit < y.misfit; };
  std::stable_sort(candidates.begin(), candidates.end(), better);
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(options.best)));
  for (Candidate& c : candidates) {
    const Points b =
        evenly(above({all_b.begin(), all_b.end()}, top_b - (options.depth + options.reach) / c.a_from_b.scale),
               options.most_points);
    c.a_from_b = refined(a, b, c.a_from_b, lowest, options);
    c.misfit = misfit(a, moved(b, c.a_from_b), lowest, options.reach);
  }
  if (candidates.empty()) return std::nullopt;
  const Candidate& best = *std::min_element(candidates.begin(), candidates.end(), better);

  CloudAlignment result;
  result.a_from_b = best.a_from_b;
  const Points b_in_a = moved(evenly(all_b, 4 * options.most_points), best.a_from_b);
  std::vector<double> distances;
  result.overlap = 1.0;
  for (const auto& [from, to] : {std::pair(&a, &b_in_a), std::pair(&b_in_a, &a)}) {
    std::size_t count = 0, near = 0;
    for (const Eigen::Vector3d& p : *from) {
      if (p.y() < lowest) continue;
      const double distance = nearest(*to, p).distance;
      ++count;
      if (distance < options.reach) {
        ++near;
        distances.push_back(distance);
      }
    }
    if (count == 0) return std::nullopt;
    result.overlap = std::min(result.overlap, static_cast<double>(near) / static_cast<double>(count));
  }
  if (result.overlap < options.min_overlap || distances.empty()) return std::nullopt;
  result.residual = median(std::move(distances));
  return result;
}

}  // namespace gyre
