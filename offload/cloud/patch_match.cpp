// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_match.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>

namespace gyre {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

// SplitMix64 (Steele et al., OOPSLA 2014): a stream of numbers for each pixel and step, whoever computes it.
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, int step, std::size_t pixel)
      : state_(seed * 0x9E3779B97F4A7C15U + static_cast<std::uint64_t>(step) * 0xD1B54A32D192ED03U +
               static_cast<std::uint64_t>(pixel) * 0x8CB92BA72F3D8DD7U) {}

  // Uniform in [0, 1).
  float uniform() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return static_cast<float>((z ^ (z >> 31U)) >> 40U) * 0x1p-24F;
  }
  float symmetric() { return 2.0F * uniform() - 1.0F; }

 private:
  std::uint64_t state_;
};

// A plane as the inverse depth it gives each array index: inverse(x, y) = slope_x * x + slope_y * y + offset, which is
// exactly affine. Kept relative to its own pixel: the value there and the two slopes.
struct Plane {
  float inverse = 0;  // 1 / depth at the pixel, 0: none
  float slope_x = 0;
  float slope_y = 0;

  float inverse_at(int dx, int dy) const {
    return inverse + slope_x * static_cast<float>(dx) + slope_y * static_cast<float>(dy);
  }
};

// A neighbour as the kernel needs it: q = from_reference * (x, y, 1) + translation * inverse depth is its homogeneous
// array index, scaled by its depth over the reference's.
struct Source {
  const QuadImage* image = nullptr;
  Matrix3f from_reference;
  Vector3f translation;
  // For the way back, when its depths are known.
  const StereoDepth* map = nullptr;
  Matrix3f to_reference;
  Vector3f back_translation;
};

struct Range {
  float least = 0;  // of inverse depth; both 0: the pixel is not looked at
  float most = 0;
};

StereoDepth nothing_known(const StereoView& view) {
  const std::size_t size = static_cast<std::size_t>(view.width()) * view.height();
  StereoDepth map{view.width(), view.height(), {}, {}, {}, {}};
  map.state.assign(size, PixelState::unknown);
  map.depth.assign(size, 0.0F);
  map.normal.assign(size, Vector3f::Zero());
  map.cost.assign(size, worst_cost);
  return map;
}

// Estimation of one view at one level of the pyramid.
class LevelSolver {
 public:
  LevelSolver(std::span<const StereoView> views, int reference, std::span<const int> neighbours, int level,
              const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed,
              std::span<const StereoDepth> maps)
      : view_(views[reference]),
        image_(view_.levels[level].image),
        options_(options),
        weights_(options.patch),
        seed_(seed),
        level_(level),
        level_is_smallest_(level + 1 == static_cast<int>(view_.levels.size())),
        width_(image_.width),
        height_(image_.height),
        world_from_cam_(view_.cam_from_world.inverse()) {
    const Eigen::Matrix3d& k = view_.levels[level].index_from_camera;
    k_inverse_ = k.inverse().cast<float>();
    k_ = k.cast<float>();
    double baseline_pixels = 0.0;
    for (const int j : neighbours.first(std::min<std::size_t>(neighbours.size(), max_neighbours))) {
      const StereoView& other = views[j];
      const Eigen::Matrix3d& kj = other.levels[level].index_from_camera;
      const Pose other_from_ref = other.cam_from_world * view_.cam_from_world.inverse();
      const Eigen::Matrix3d rotation = other_from_ref.rotation.toRotationMatrix();
      Source source;
      source.image = &other.levels[level].image;
      source.from_reference = (kj * rotation * k.inverse()).cast<float>();
      source.translation = (kj * other_from_ref.translation).cast<float>();
      if (!maps.empty()) {
        source.map = &maps[j];
        source.to_reference = (k * rotation.transpose() * kj.inverse()).cast<float>();
        source.back_translation = (-(k * rotation.transpose() * other_from_ref.translation)).cast<float>();
      }
      baseline_pixels += k(0, 0) * other_from_ref.translation.norm();
      sources_.push_back(source);
    }
    pixel_step_ = static_cast<float>(static_cast<double>(sources_.size()) / baseline_pixels);
    find_ranges(region);
    planes_.resize(ranges_.size());
    costs_.assign(ranges_.size(), worst_cost);
    chosen_.assign(ranges_.size(), static_cast<std::uint16_t>((1U << sources_.size()) - 1U));
  }

  int width() const { return width_; }
  int height() const { return height_; }

  void start_random() {
    for_each_active([&](int x, int y, std::size_t i) {
      PixelRandom random(seed_, step_id(-1), i);
      planes_[i] = random_plane(x, y, random);
    });
    score_all();
  }

  // Takes over a smaller level's planes; pixels without a good one nearby are switched off.
  void start_from(const LevelSolver& coarse, const SubjectRegion& region) {
    const std::vector<char> wanted = coarse.worth_following(region);
    beyond_.assign(planes_.size(), 0.0F);
    for_each_active([&](int x, int y, std::size_t i) {
      const int cx = std::min(x / 2, coarse.width_ - 1);
      const int cy = std::min(y / 2, coarse.height_ - 1);
      const std::size_t c = static_cast<std::size_t>(cy) * coarse.width_ + cx;
      if (wanted[c] == 0) {
        ranges_[i] = {};
        beyond_[i] = coarse.known_beyond(region, cx, cy);
        return;
      }
      // Index x of this level is index (x - 0.5) / 2 of the smaller one.
      const Plane& p = coarse.planes_[c];
      const float dx = 0.5F * static_cast<float>(x) - 0.25F - static_cast<float>(cx);
      const float dy = 0.5F * static_cast<float>(y) - 0.25F - static_cast<float>(cy);
      planes_[i] = {p.inverse + p.slope_x * dx + p.slope_y * dy, 0.5F * p.slope_x, 0.5F * p.slope_y};
      if (!admissible(planes_[i], x, y)) {
        PixelRandom random(seed_, step_id(-1), i);
        planes_[i] = random_plane(x, y, random);
      }
    });
    score_all();
  }

  void start_from(const StereoDepth& map) {
    beyond_.assign(planes_.size(), 0.0F);
    for (std::size_t i = 0; i < beyond_.size(); ++i) {
      if (map.state[i] == PixelState::beyond) beyond_[i] = map.depth[i];
    }
    for_each_active([&](int x, int y, std::size_t i) {
      if (map.state[i] != PixelState::surface) {
        ranges_[i] = {};
        return;
      }
      planes_[i] = plane_from(x, y, 1.0F / map.depth[i], map.normal[i]);
    });
    score_all();
  }

  // One red-black iteration. `reach`: size of the random changes, pixels of disparity.
  void iterate(int iteration, float reach) {
    for (int colour = 0; colour < 2; ++colour) {
      for_each_active([&](int x, int y, std::size_t i) {
        if ((x + y) % 2 == colour) improve(x, y, i, iteration, reach);
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
      map.normal[i] = normal_of(planes_[i], x, y);
      map.cost[i] = costs_[i];
    });
    return map;
  }

 private:
  template <class Visit>
  void for_each_active(const Visit& visit) const {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
        if (ranges_[i].most > 0) visit(x, y, i);
      }
    }
  }

  int step_id(int iteration) const { return 64 * level_ + iteration + 1; }

  Vector3f ray(int x, int y) const { return k_inverse_ * Vector3f(static_cast<float>(x), static_cast<float>(y), 1.0F); }

  void find_ranges(const SubjectRegion& region) {
    ranges_.assign(static_cast<std::size_t>(width_) * height_, {});
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        // The ray has depth 1 in camera coordinates, so t is depth.
        const auto hit =
            intersect(region, world_from_cam_.translation, world_from_cam_.rotation * ray(x, y).cast<double>());
        if (!hit || hit->far < 1e-3) continue;
        const float near = std::max(static_cast<float>(hit->near), 0.02F * static_cast<float>(hit->far));
        ranges_[static_cast<std::size_t>(y) * width_ + x] = {
            1.0F / (options_.background_reach * static_cast<float>(hit->far)), 1.0F / near};
      }
    }
  }

  // n . X = d gives 1 / z = (n . ray) / d, and ray is affine in the index.
  Plane plane_from(int x, int y, float inverse, const Vector3f& normal) const {
    const float scale = inverse / normal.dot(ray(x, y));
    return {inverse, scale * normal.x() * k_inverse_(0, 0), scale * normal.y() * k_inverse_(1, 1)};
  }

  Vector3f normal_of(const Plane& plane, int x, int y) const {
    const float a = plane.slope_x * k_(0, 0);
    const float b = plane.slope_y * k_(1, 1);
    const Vector3f r = ray(x, y);
    return -Vector3f(a, b, plane.inverse - a * r.x() - b * r.y()).normalized();
  }

  // In range and seen from the front, less than about 80 degrees from the ray.
  bool admissible(const Plane& plane, int x, int y) const {
    const Range& range = ranges_[static_cast<std::size_t>(y) * width_ + x];
    if (!(plane.inverse >= range.least && plane.inverse <= range.most)) return false;
    const Vector3f r = ray(x, y);
    return -normal_of(plane, x, y).dot(r) > 0.17F * r.norm();
  }

  Plane random_plane(int x, int y, PixelRandom& random) const {
    const Range& range = ranges_[static_cast<std::size_t>(y) * width_ + x];
    const float inverse = range.least + random.uniform() * (range.most - range.least);
    return plane_from(x, y, inverse, tilted(-ray(x, y).normalized(), 1.0F, random));
  }

  // The direction moved by up to `amount` in the tangent plane.
  static Vector3f tilted(const Vector3f& direction, float amount, PixelRandom& random) {
    const float a = random.symmetric();
    const float b = random.symmetric();
    const float c = random.symmetric();
    return (direction + amount * Vector3f(a, b, c)).normalized();
  }

  // The reference side of one pixel, shared by all hypotheses there.
  struct Site {
    int x, y;
    ReferencePatch patch;
    std::array<Vector3f, max_neighbours> base;
    std::array<std::uint8_t, max_neighbours> sources;  // to compare with
    std::size_t source_count;
  };

  Site site_of(int x, int y, std::uint16_t chosen) const {
    Site site{x, y, weights_.reference_patch(view_.levels[level_], x, y), {}, {}, 0};
    const Vector3f index(static_cast<float>(x), static_cast<float>(y), 1.0F);
    for (std::size_t j = 0; j < sources_.size(); ++j) {
      if ((chosen >> j & 1U) == 0) continue;
      site.sources[site.source_count] = static_cast<std::uint8_t>(j);
      site.base[site.source_count++] = sources_[j].from_reference * index;
    }
    return site;
  }

  // Cost of a plane in the n-th source of the site.
  float source_cost(const Site& site, std::size_t n, const Plane& plane) const {
    const Source& source = sources_[site.sources[n]];
    const Vector3f centre = site.base[n] + source.translation * plane.inverse;
    const Vector3f along_x = source.from_reference.col(0) + source.translation * plane.slope_x;
    const Vector3f along_y = source.from_reference.col(1) + source.translation * plane.slope_y;
    const PatchMapping mapping{{centre.x(), centre.y(), centre.z()},
                               {along_x.x(), along_x.y(), along_x.z()},
                               {along_y.x(), along_y.y(), along_y.z()}};
    const float cost = matching_cost(site.patch, mapping, *source.image, options_.patch.noise);
    if (source.map == nullptr) return cost;
    return cost + options_.consistency_weight * round_trip(site, source, centre);
  }

  // Mean of the best sources' costs; stops early, with some larger value, once that cannot be below `limit`.
  float score(const Site& site, const Plane& plane, float limit) const {
    const std::size_t wanted = std::min<std::size_t>(options_.best_views, site.source_count);
    std::array<float, max_neighbours> best;
    const float limit_sum = limit * static_cast<float>(wanted);
    float sum = 0;
    for (std::size_t n = 0; n < site.source_count; ++n) {
      const float cost = source_cost(site, n, plane);
      std::size_t at = std::min(n, wanted);
      for (; at > 0 && best[at - 1] > cost; --at) {
        if (at < wanted) best[at] = best[at - 1];
      }
      if (at < wanted) best[at] = cost;
      // At least this many of those so far stay among the best, whatever the remaining ones cost.
      const std::size_t remaining = site.source_count - n - 1;
      sum = 0;
      for (std::size_t k = 0; k + remaining < wanted; ++k) sum += best[k];
      if (sum >= limit_sum) return worst_cost * 2;
    }
    return sum / static_cast<float>(wanted);
  }

  // Distance in pixels between the site and where the neighbour's depth there leads back to.
  float round_trip(const Site& site, const Source& source, const Vector3f& centre) const {
    const float limit = options_.consistency_limit;
    if (!(centre.z() > 0)) return limit;
    const float u = centre.x() / centre.z();
    const float v = centre.y() / centre.z();
    const int x = static_cast<int>(std::lround(std::clamp(u, -1.0F, static_cast<float>(source.map->width))));
    const int y = static_cast<int>(std::lround(std::clamp(v, -1.0F, static_cast<float>(source.map->height))));
    if (x < 0 || y < 0 || x >= source.map->width || y >= source.map->height) return limit;
    const float depth = source.map->depth[source.map->index(x, y)];
    if (depth <= 0) return limit;
    const Vector3f back = source.to_reference * Vector3f(u, v, 1.0F) + source.back_translation / depth;
    if (!(back.z() > 0)) return limit;
    const float dx = back.x() / back.z() - static_cast<float>(site.x);
    const float dy = back.y() / back.z() - static_cast<float>(site.y);
    return std::min(std::sqrt(dx * dx + dy * dy), limit);
  }

  // Costs of the present planes, and from them the sources each pixel is compared with from now on.
  void score_all() {
    const auto all = static_cast<std::uint16_t>((1U << sources_.size()) - 1U);
    for_each_active([&](int x, int y, std::size_t i) {
      const Site site = site_of(x, y, all);
      std::array<std::pair<float, std::size_t>, max_neighbours> ranked;
      for (std::size_t n = 0; n < site.source_count; ++n) ranked[n] = {source_cost(site, n, planes_[i]), n};
      std::sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(site.source_count));
      const std::size_t wanted = std::min<std::size_t>(options_.best_views, site.source_count);
      costs_[i] = 0;
      for (std::size_t n = 0; n < wanted; ++n) costs_[i] += ranked[n].first / static_cast<float>(wanted);
      if (level_is_smallest_) return;
      chosen_[i] = 0;
      const std::size_t compared = std::min(wanted + 1, site.source_count);
      for (std::size_t n = 0; n < compared; ++n) chosen_[i] |= static_cast<std::uint16_t>(1U << ranked[n].second);
    });
  }

  void try_plane(const Site& site, std::size_t i, const Plane& plane) {
    if (!admissible(plane, site.x, site.y)) return;
    const float cost = score(site, plane, costs_[i]);
    if (cost < costs_[i]) {
      costs_[i] = cost;
      planes_[i] = plane;
    }
  }

  // True when two planes put the patch on the same place to a few hundredths of a pixel.
  bool same(const Plane& a, const Plane& b) const {
    const float tolerance = 0.03F * pixel_step_;
    return std::abs(a.inverse - b.inverse) < tolerance && std::abs(a.slope_x - b.slope_x) < 0.3F * tolerance &&
           std::abs(a.slope_y - b.slope_y) < 0.3F * tolerance;
  }

  void improve(int x, int y, std::size_t i, int iteration, float reach) {
    const Site site = site_of(x, y, chosen_[i]);
    // Planes have already come from afar at the smallest level.
    const std::size_t areas = level_is_smallest_ ? propagation_areas.size() : propagation_areas.size() / 2;
    for (std::size_t area = 0; area < areas; ++area) {
      float best = std::numeric_limits<float>::max();
      Plane candidate;
      for (const auto [dx, dy] : propagation_areas[area]) {
        const int nx = x + dx;
        const int ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= width_ || ny >= height_) continue;
        const std::size_t n = static_cast<std::size_t>(ny) * width_ + nx;
        if (ranges_[n].most <= 0 || costs_[n] >= best) continue;
        best = costs_[n];
        const Plane& p = planes_[n];
        candidate = {p.inverse_at(-dx, -dy), p.slope_x, p.slope_y};
      }
      if (best < std::numeric_limits<float>::max() && !same(candidate, planes_[i])) try_plane(site, i, candidate);
    }
    PixelRandom random(seed_, step_id(iteration), i);
    if (costs_[i] > 0.6F && reach >= 1.0F) try_plane(site, i, random_plane(x, y, random));
    const float tilt = 0.25F * std::min(reach, 1.0F);
    for (const float share : {1.0F, 0.3F}) {
      const Plane& now = planes_[i];
      try_plane(site, i, {now.inverse + share * reach * pixel_step_ * random.symmetric(), now.slope_x, now.slope_y});
      const Vector3f normal = tilted(normal_of(planes_[i], x, y), share * tilt, random);
      if (normal.dot(ray(x, y)) < 0) try_plane(site, i, plane_from(x, y, planes_[i].inverse, normal));
    }
  }

  bool is_inside(const SubjectRegion& region, int x, int y, float inverse) const {
    return region.contains(world_from_cam_ * (ray(x, y) / inverse).cast<double>());
  }

  // Depth of a pixel that matches well outside the region, or that an even smaller level knew; else 0.
  float known_beyond(const SubjectRegion& region, int x, int y) const {
    const std::size_t i = static_cast<std::size_t>(y) * width_ + x;
    if (ranges_[i].most <= 0) return beyond_.empty() ? 0.0F : beyond_[i];
    if (costs_[i] > options_.beyond_cost || is_inside(region, x, y, planes_[i].inverse)) return 0.0F;
    return 1.0F / planes_[i].inverse;
  }

  // Pixels whose plane lies in the region (or nearly) and matches, and those around them.
  std::vector<char> worth_following(const SubjectRegion& region) const {
    constexpr int margin = 3;
    const Eigen::Vector3d slack = 0.02 * (region.max - region.min);
    const SubjectRegion wide{region.min - slack, region.max + slack};
    std::vector<char> wanted(planes_.size(), 0);
    for_each_active([&](int x, int y, std::size_t i) {
      if (costs_[i] > options_.keep_cost) return;
      if (!is_inside(wide, x, y, planes_[i].inverse)) return;
      for (int ny = std::max(y - margin, 0); ny <= std::min(y + margin, height_ - 1); ++ny) {
        for (int nx = std::max(x - margin, 0); nx <= std::min(x + margin, width_ - 1); ++nx) {
          wanted[static_cast<std::size_t>(ny) * width_ + nx] = 1;
        }
      }
    });
    return wanted;
  }

  struct PixelOffset {
    int dx, dy;
  };
  // Up, down, left, right; near and far. All offsets are odd, so that they point to the other colour.
  static constexpr std::array<std::array<PixelOffset, 5>, 8> propagation_areas = {{
      {{{0, -1}, {-1, -2}, {1, -2}, {0, -3}, {0, -3}}},
      {{{0, 1}, {-1, 2}, {1, 2}, {0, 3}, {0, 3}}},
      {{{-1, 0}, {-2, -1}, {-2, 1}, {-3, 0}, {-3, 0}}},
      {{{1, 0}, {2, -1}, {2, 1}, {3, 0}, {3, 0}}},
      {{{0, -5}, {0, -7}, {0, -9}, {0, -13}, {0, -17}}},
      {{{0, 5}, {0, 7}, {0, 9}, {0, 13}, {0, 17}}},
      {{{-5, 0}, {-7, 0}, {-9, 0}, {-13, 0}, {-17, 0}}},
      {{{5, 0}, {7, 0}, {9, 0}, {13, 0}, {17, 0}}},
  }};

  const StereoView& view_;
  const QuadImage& image_;
  const PatchMatchOptions& options_;
  PatchWeights weights_;
  std::uint64_t seed_;
  int level_;
  bool level_is_smallest_;
  int width_;
  int height_;
  Pose world_from_cam_;
  Matrix3f k_;
  Matrix3f k_inverse_;
  std::vector<Source> sources_;
  float pixel_step_ = 0;  // change of inverse depth that moves a match by about one pixel
  std::vector<Range> ranges_;
  std::vector<Plane> planes_;
  std::vector<float> costs_;
  std::vector<float> beyond_;          // depth known from smaller levels where it lies outside the region
  std::vector<std::uint16_t> chosen_;  // bit j: the pixel is compared with sources_[j]
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
                                         std::span<const StereoDepth>());
  };
  auto solver = solver_at(level);
  solver->start_random();
  for (int i = 0; i < options.coarse_iterations; ++i) {
    solver->iterate(i, i < 2 ? 4.0F : 4.0F / static_cast<float>(i + 1));
  }
  while (level > 0) {
    auto finer = solver_at(--level);
    finer->start_from(*solver, region);
    for (int i = 0; i < options.fine_iterations; ++i) finer->iterate(i, 1.0F / static_cast<float>(1 << i));
    solver = std::move(finer);
  }
  return solver->result();
}

StereoDepth refine_depth(std::span<const StereoView> views, std::span<const StereoDepth> maps, int reference,
                         std::span<const int> neighbours, const SubjectRegion& region, const PatchMatchOptions& options,
                         std::uint64_t seed) {
  if (neighbours.empty()) return nothing_known(views[reference]);
  LevelSolver solver(views, reference, neighbours, 0, region, options, seed, maps);
  solver.start_from(maps[reference]);
  solver.iterate(32, 0.5F);
  return solver.result();
}

}  // namespace gyre
