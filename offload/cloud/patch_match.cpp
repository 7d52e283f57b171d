// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_match.h"

#include "offload/cloud/plane_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace gyre {
namespace {

using Eigen::Vector3f;

StereoDepth nothing_known(const StereoView& view) {
  const std::size_t size = static_cast<std::size_t>(view.width()) * view.height();
  StereoDepth map{view.width(), view.height(), {}, {}, {}, {}};
  map.state.assign(size, PixelState::unknown);
  map.depth.assign(size, 0.0F);
  map.normal.assign(size, Vector3f::Zero());
  map.cost.assign(size, worst_cost);
  return map;
}

struct PixelOffset {
  int dx, dy;
};
// Up, down, left, right; near and far. All offsets are odd, so that they point to the other colour.
constexpr std::array<std::array<PixelOffset, 5>, 8> propagation_areas = {{
    {{{0, -1}, {-1, -2}, {1, -2}, {0, -3}, {0, -3}}},
    {{{0, 1}, {-1, 2}, {1, 2}, {0, 3}, {0, 3}}},
    {{{-1, 0}, {-2, -1}, {-2, 1}, {-3, 0}, {-3, 0}}},
    {{{1, 0}, {2, -1}, {2, 1}, {3, 0}, {3, 0}}},
    {{{0, -5}, {0, -7}, {0, -9}, {0, -13}, {0, -17}}},
    {{{0, 5}, {0, 7}, {0, 9}, {0, 13}, {0, 17}}},
    {{{-5, 0}, {-7, 0}, {-9, 0}, {-13, 0}, {-17, 0}}},
    {{{5, 0}, {7, 0}, {9, 0}, {13, 0}, {17, 0}}},
}};

// Estimation of one view at one level of the pyramid.
class LevelSolver {
 public:
  LevelSolver(std::span<const StereoView> views, int reference, std::span<const int> neighbours, int level,
              const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed,
              std::span<const std::vector<float>> depths)
      : view_(views[reference]),
        region_(region),
        options_(options),
        seed_(seed),
        level_(level),
        space_(view_, level, region, options.background_reach),
        cost_(views, reference, neighbours, level, options.judging, depths),
        planes_(space_.size()),
        costs_(space_.size(), worst_cost),
        compared_(space_.size(), cost_.all()),
        resting_(space_.size(), 0) {}

  void start_random() {
    for_each_active([&](int x, int y, std::size_t i) {
      PixelRandom random(seed_, step_id(-1), i);
      planes_[i] = space_.random_plane(x, y, random);
    });
    rank_neighbours(max_neighbours);
  }

  // Takes over a smaller level's planes; pixels without a good one nearby are switched off.
  void start_from(const LevelSolver& coarse) {
    const std::vector<char> wanted = coarse.worth_following();
    beyond_.assign(planes_.size(), 0.0F);
    for_each_active([&](int x, int y, std::size_t i) {
      const int cx = std::min(x / 2, coarse.space_.width() - 1);
      const int cy = std::min(y / 2, coarse.space_.height() - 1);
      const std::size_t c = coarse.space_.index(cx, cy);
      if (wanted[c] == 0) {
        space_.remove(i);
        beyond_[i] = coarse.known_beyond(cx, cy);
        return;
      }
      // Index x of this level is index (x - 0.5) / 2 of the smaller one.
      const SlantedPlane& p = coarse.planes_[c];
      const float dx = 0.5F * static_cast<float>(x) - 0.25F - static_cast<float>(cx);
      const float dy = 0.5F * static_cast<float>(y) - 0.25F - static_cast<float>(cy);
      planes_[i] = {p.inverse_at(dx, dy), 0.5F * p.slope_x, 0.5F * p.slope_y};
      if (!space_.admissible(planes_[i], x, y)) {
        PixelRandom random(seed_, step_id(-1), i);
        planes_[i] = space_.random_plane(x, y, random);
      }
    });
    // One neighbour to spare while planes still move far.
    rank_neighbours(options_.judging.best_views + (level_ > 0 ? 1 : 0));
  }

  void start_from(const StereoDepth& map) {
    beyond_.assign(planes_.size(), 0.0F);
    for (std::size_t i = 0; i < beyond_.size(); ++i) {
      if (map.state[i] == PixelState::beyond) beyond_[i] = map.depth[i];
    }
    for_each_active([&](int x, int y, std::size_t i) {
      if (map.state[i] != PixelState::surface) {
        space_.remove(i);
        return;
      }
      planes_[i] = space_.plane_from(x, y, 1.0F / map.depth[i], map.normal[i]);
    });
    rank_neighbours(options_.judging.best_views);
  }

  // From now on pixels are compared with the `kept` neighbours their planes match best.
  void rank_neighbours(int kept) {
    for_each_active([&](int x, int y, std::size_t i) {
      const PlaneCost::Ranking ranking = cost_.rank(cost_.site(x, y, cost_.all()), planes_[i], kept);
      costs_[i] = ranking.cost;
      compared_[i] = ranking.best;
    });
  }

  // From now on pixels of the background with nothing but background around them keep their planes.
  void rest_background() {
    constexpr int margin = 2;
    resting_.assign(planes_.size(), 1);
    for_each_active([&](int x, int y, std::size_t i) {
      if (is_subject(x, y, planes_[i], region_)) mark_around(resting_, x, y, margin, 0);
    });
  }

  // One red-black iteration. `reach`: size of the random changes, pixels of disparity. `areas`: of propagation.
  void iterate(int iteration, float reach, std::size_t areas) {
    for (int colour = 0; colour < 2; ++colour) {
      for_each_active([&](int x, int y, std::size_t i) {
        if ((x + y) % 2 == colour && resting_[i] == 0) improve(x, y, i, iteration, reach, areas);
      });
    }
  }

  StereoDepth result() const {
    StereoDepth map = nothing_known(view_);
    for (std::size_t i = 0; i < beyond_.size(); ++i) {
      if (beyond_[i] > 0) {
        map.state[i] = PixelState::beyond;
        map.depth[i] = beyond_[i];
      }
    }
    for_each_active([&](int x, int y, std::size_t i) {
      map.state[i] = PixelState::surface;
      map.depth[i] = 1.0F / planes_[i].inverse;
      map.normal[i] = space_.normal_of(planes_[i], x, y);
      map.cost[i] = costs_[i];
    });
    return map;
  }

 private:
  template <class Visit>
  void for_each_active(const Visit& visit) const {
    for (int y = 0; y < space_.height(); ++y) {
      for (int x = 0; x < space_.width(); ++x) {
        const std::size_t i = space_.index(x, y);
        if (space_.has(i)) visit(x, y, i);
      }
    }
  }

  int step_id(int iteration) const { return 64 * level_ + iteration + 1; }

  void mark_around(std::vector<char>& flags, int x, int y, int margin, char value) const {
    for (int ny = std::max(y - margin, 0); ny <= std::min(y + margin, space_.height() - 1); ++ny) {
      for (int nx = std::max(x - margin, 0); nx <= std::min(x + margin, space_.width() - 1); ++nx)
        flags[space_.index(nx, ny)] = value;
    }
  }

  bool is_subject(int x, int y, const SlantedPlane& plane, const SubjectRegion& region) const {
    const Eigen::Vector3d point = space_.world_point(x, y, plane.inverse);
    return region.contains(point) && !is_floor(point.y(), space_.up(plane, x, y), options_.floor);
  }

  void try_plane(const PlaneSite& site, std::size_t i, const SlantedPlane& plane) {
    if (!space_.admissible(plane, site.x, site.y)) return;
    const float cost = cost_.judge(site, plane, costs_[i]);
    if (cost < costs_[i]) {
      costs_[i] = cost;
      planes_[i] = plane;
    }
  }

  // True when two planes put the patch on the same place to a few hundredths of a pixel.
  bool same(const SlantedPlane& a, const SlantedPlane& b) const {
    const float tolerance = 0.03F * cost_.pixel_step();
    return std::abs(a.inverse - b.inverse) < tolerance && std::abs(a.slope_x - b.slope_x) < 0.3F * tolerance &&
           std::abs(a.slope_y - b.slope_y) < 0.3F * tolerance;
  }

  void improve(int x, int y, std::size_t i, int iteration, float reach, std::size_t areas) {
    const PlaneSite site = cost_.site(x, y, compared_[i]);
    for (std::size_t area = 0; area < areas; ++area) {
      float best = std::numeric_limits<float>::max();
      SlantedPlane candidate;
      for (const auto [dx, dy] : propagation_areas[area]) {
        const int nx = x + dx;
        const int ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= space_.width() || ny >= space_.height()) continue;
        const std::size_t n = space_.index(nx, ny);
        if (!space_.has(n) || costs_[n] >= best) continue;
        best = costs_[n];
        const SlantedPlane& p = planes_[n];
        candidate = {p.inverse_at(static_cast<float>(-dx), static_cast<float>(-dy)), p.slope_x, p.slope_y};
      }
      if (best < std::numeric_limits<float>::max() && !same(candidate, planes_[i])) try_plane(site, i, candidate);
    }
    PixelRandom random(seed_, step_id(iteration), i);
    if (costs_[i] > 0.6F && reach >= 1.0F) try_plane(site, i, space_.random_plane(x, y, random));
    const float tilt = 0.25F * std::min(reach, 1.0F);
    for (const float share : {1.0F, 0.3F}) {
      const SlantedPlane& now = planes_[i];
      const float step = share * reach * cost_.pixel_step() * random.symmetric();
      try_plane(site, i, {now.inverse + step, now.slope_x, now.slope_y});
      const Vector3f normal = tilted(space_.normal_of(planes_[i], x, y), share * tilt, random);
      if (normal.dot(space_.ray(x, y)) < 0) try_plane(site, i, space_.plane_from(x, y, planes_[i].inverse, normal));
    }
  }

  // Depth of a pixel that matches well and is not the subject, or that an even smaller level knew; else 0.
  float known_beyond(int x, int y) const {
    const std::size_t i = space_.index(x, y);
    if (!space_.has(i)) return beyond_.empty() ? 0.0F : beyond_[i];
    if (costs_[i] > options_.beyond_cost || is_subject(x, y, planes_[i], region_)) return 0.0F;
    return 1.0F / planes_[i].inverse;
  }

  // Pixels whose plane may be the subject's (or nearly) and matches, and those around them.
  std::vector<char> worth_following() const {
    constexpr int margin = 3;
    const Eigen::Vector3d slack = 0.02 * (region_.max - region_.min);
    const SubjectRegion wide{region_.min - slack, region_.max + slack};
    std::vector<char> wanted(planes_.size(), 0);
    for_each_active([&](int x, int y, std::size_t i) {
      if (costs_[i] <= options_.keep_cost && is_subject(x, y, planes_[i], wide)) mark_around(wanted, x, y, margin, 1);
    });
    return wanted;
  }

  const StereoView& view_;
  const SubjectRegion& region_;
  const PatchMatchOptions& options_;
  std::uint64_t seed_;
  int level_;
  PlaneSpace space_;
  PlaneCost cost_;
  std::vector<SlantedPlane> planes_;
  std::vector<float> costs_;
  std::vector<float> beyond_;  // depth known from smaller levels where it is not the subject's
  std::vector<NeighbourSet> compared_;
  std::vector<char> resting_;
};

}  // namespace

StereoDepth estimate_depth(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                           const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed) {
  const StereoView& view = views[reference];
  if (neighbours.empty()) return nothing_known(view);
  int level = static_cast<int>(view.levels.size()) - 1;
  for (const int j : neighbours) level = std::min(level, static_cast<int>(views[j].levels.size()) - 1);

  const auto solver_at = [&](int at) {
    return std::make_unique<LevelSolver>(views, reference, neighbours, at, region, options, seed,
                                         std::span<const std::vector<float>>());
  };
  auto solver = solver_at(level);
  solver->start_random();
  for (int i = 0; i < options.coarse_iterations; ++i) {
    // Once planes have come from afar, most neighbours that do not see the pixel are known.
    if (i == 2) solver->rank_neighbours(options.judging.best_views + 2);
    solver->iterate(i, i < 2 ? 4.0F : 4.0F / static_cast<float>(i + 1), propagation_areas.size());
  }
  while (level > 0) {
    auto finer = solver_at(--level);
    finer->start_from(*solver);
    for (int i = 0; i < options.fine_iterations; ++i) {
      finer->iterate(i, 1.0F / static_cast<float>(1 << i), propagation_areas.size() / 2);
      if (i == 0) finer->rest_background();
    }
    solver = std::move(finer);
  }
  return solver->result();
}

StereoDepth refine_depth(std::span<const StereoView> views, std::span<const std::vector<float>> depths,
                         const StereoDepth& map, int reference, std::span<const int> neighbours,
                         const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed) {
  if (neighbours.empty()) return nothing_known(views[reference]);
  LevelSolver solver(views, reference, neighbours, 0, region, options, seed, depths);
  solver.start_from(map);
  solver.rest_background();
  solver.iterate(32, 0.5F, propagation_areas.size() / 2);
  return solver.result();
}

}  // namespace gyre
