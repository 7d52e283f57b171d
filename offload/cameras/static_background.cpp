// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/static_background.h"

#include "common/geometry/quantile.h"
#include "common/parallel/parallel.h"

namespace gyre {

namespace {

constexpr double cell_size = 8.0;       // pixels
constexpr std::size_t voters = 1000;    // largest keypoints that tell how far a picture has shifted
constexpr double grid_of_picture = 12;  // cells of each side that spread is counted in

// Descriptors of a picture by the place of their keypoints.
class PlaceIndex {
 public:
  explicit PlaceIndex(const Features& features)
      : features_(features),
        columns_(static_cast<int>(features.width / cell_size) + 1),
        rows_(static_cast<int>(features.height / cell_size) + 1),
        cells_(static_cast<std::size_t>(columns_ * rows_)) {
    for (std::size_t d = 0; d < features.descriptors.size(); ++d) {
      const Eigen::Vector2d& p = place_of(d);
      cells_[cell(std::clamp(column(p.x()), 0, columns_ - 1), std::clamp(column(p.y()), 0, rows_ - 1))].push_back(d);
    }
  }

  // Calls use(displacement) for all descriptors near `place` that are at most `max_distance` from the given one.
  template <typename Use>
  void each_similar(const Descriptor& descriptor, const Eigen::Vector2d& place, double reach, double max_distance,
                    const Use& use) const {
    const double min_dot = (1.0 - 0.5 * max_distance * max_distance) * descriptor_norm * descriptor_norm;
    const int last_row = std::min(rows_ - 1, column(place.y() + reach));
    const int last_column = std::min(columns_ - 1, column(place.x() + reach));
    for (int r = std::max(0, column(place.y() - reach)); r <= last_row; ++r) {
      for (int c = std::max(0, column(place.x() - reach)); c <= last_column; ++c) {
        for (const std::size_t d : cells_[cell(c, r)]) {
          const Eigen::Vector2d displacement = place_of(d) - place;
          if (displacement.squaredNorm() > reach * reach) continue;
          const Descriptor& other = features_.descriptors[d];
          std::int32_t dot = 0;
          for (std::size_t i = 0; i < other.size(); ++i) dot += descriptor[i] * other[i];
          if (dot >= min_dot) use(displacement);
        }
      }
    }
  }

 private:
  static int column(double pixel) { return static_cast<int>(std::floor(pixel / cell_size)); }
  std::size_t cell(int c, int r) const { return static_cast<std::size_t>(r * columns_ + c); }
  const Eigen::Vector2d& place_of(std::size_t descriptor) const {
    return features_.keypoints[static_cast<std::size_t>(features_.keypoint_of[descriptor])];
  }

  const Features& features_;
  int columns_, rows_;
  std::vector<std::vector<std::size_t>> cells_;
};

double still_radius(const Features& features, const StillnessOptions& options) {
  return std::max(options.min_radius, options.radius * std::max(features.width, features.height));
}

// Where most keypoints of `reference` are found again in `features` when all have moved by one displacement; zero when
// too few agree on any.
Eigen::Vector2d shift_against(const PlaceIndex& features, const Features& reference, double radius, double reach,
                              const StillnessOptions& options) {
  std::vector<Eigen::Vector2d> displacements;
  std::map<std::pair<int, int>, int> votes;  // by cells of the radius
  for (std::size_t d = 0; d < std::min(voters, reference.descriptors.size()); ++d) {
    const auto& place = reference.keypoints[static_cast<std::size_t>(reference.keypoint_of[d])];
    features.each_similar(reference.descriptors[d], place, reach, options.max_distance,
                          [&](const Eigen::Vector2d& displacement) { displacements.push_back(displacement); });
  }
  const auto bin = [&](double pixels) { return static_cast<int>(std::lround(pixels / radius)); };
  for (const Eigen::Vector2d& d : displacements) ++votes[{bin(d.x()), bin(d.y())}];
  int most = options.min_keypoints - 1;
  Eigen::Vector2d peak = Eigen::Vector2d::Zero();
  for (const auto& [place, count] : votes) {
    if (count <= most) continue;
    most = count;
    peak = radius * Eigen::Vector2d(place.first, place.second);
  }
  std::vector<double> x, y;
  for (const Eigen::Vector2d& d : displacements) {
    if ((d - peak).norm() > radius) continue;
    x.push_back(d.x());
    y.push_back(d.y());
  }
  if (static_cast<int>(x.size()) < options.min_keypoints) return Eigen::Vector2d::Zero();
  return {median(x), median(y)};
}

// Up to `most` members other than `self`, evenly spread.
std::vector<std::size_t> others_of(const std::vector<std::size_t>& members, std::size_t self, int most) {
  std::vector<std::size_t> others;
  std::copy_if(members.begin(), members.end(), std::back_inserter(others),
               [&](std::size_t other) { return other != self; });
  const auto wanted = static_cast<std::size_t>(most);
  if (others.size() <= wanted) return others;
  std::vector<std::size_t> spread;
  for (std::size_t i = 0; i < wanted; ++i) spread.push_back(others[i * others.size() / wanted]);
  return spread;
}

// Per keypoint: 1 when a still one lies within its surroundings. There the outline of the subject has been found
// against the background: it glides over the subject, and looks alike from the front and from the back.
std::vector<char> touches_still(const Features& features, const std::vector<char>& still,
                                const StillnessOptions& options) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> still_in;  // cells of the picture
  const auto cell = [](double pixel) { return static_cast<int>(std::floor(pixel / cell_size)); };
  for (std::size_t k = 0; k < still.size(); ++k)
    if (still[k] != 0) still_in[{cell(features.keypoints[k].x()), cell(features.keypoints[k].y())}].push_back(k);
  std::vector<char> touches = still;
  for (std::size_t k = 0; k < still.size(); ++k) {
    if (still[k] != 0) continue;
    const Eigen::Vector2d& p = features.keypoints[k];
    const double reach = options.surroundings * features.sizes[k];
    for (int r = cell(p.y() - reach); r <= cell(p.y() + reach); ++r) {
      for (int c = cell(p.x() - reach); c <= cell(p.x() + reach); ++c) {
        const auto found = still_in.find({c, r});
        if (found == still_in.end()) continue;
        for (const std::size_t other : found->second)
          if ((features.keypoints[other] - p).norm() <= reach) touches[k] = 1;
      }
    }
  }
  return touches;
}

bool has_background(const Features& features, const std::vector<char>& still, const StillnessOptions& options) {
  std::set<std::pair<int, int>> cells;
  int count = 0;
  for (std::size_t k = 0; k < still.size(); ++k) {
    if (still[k] == 0) continue;
    ++count;
    cells.emplace(static_cast<int>(grid_of_picture * features.keypoints[k].x() / features.width),
                  static_cast<int>(grid_of_picture * features.keypoints[k].y() / features.height));
  }
  return count >= options.min_keypoints && static_cast<int>(cells.size()) >= options.min_cells;
}

}  // namespace

StaticBackground find_static_background(std::span<const Features> features, std::span<const int> pass_of,
                                        const StillnessOptions& options, int threads) {
  StaticBackground background;
  background.motion.assign(features.size(), Motion::orbit);
  background.shift.assign(features.size(), Eigen::Vector2d::Zero());
  background.still.resize(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) background.still[i].assign(features[i].keypoints.size(), 0);
  std::map<int, std::vector<std::size_t>> passes;
  for (std::size_t i = 0; i < features.size(); ++i) passes[pass_of[i]].push_back(i);

  std::vector<std::optional<PlaceIndex>> indices(features.size());
  parallel_for(features.size(), threads, [&](std::size_t i) { indices[i].emplace(features[i]); });
  for (const auto& entry : passes) {
    const std::vector<std::size_t>& members = entry.second;
    const std::size_t reference = *std::max_element(members.begin(), members.end(), [&](std::size_t a, std::size_t b) {
      return features[a].keypoints.size() < features[b].keypoints.size();
    });
    const double longer_side = std::max(features[reference].width, features[reference].height);
    const double radius = still_radius(features[reference], options);
    parallel_for(members.size(), threads, [&](std::size_t m) {
      background.shift[members[m]] =
          shift_against(*indices[members[m]], features[reference], radius, options.max_shift * longer_side, options);
    });
    std::vector<char> seen(members.size(), 0);
    parallel_for(members.size(), threads, [&](std::size_t m) {
      const std::size_t a = members[m];
      const Features& of_a = features[a];
      const std::vector<std::size_t> others = others_of(members, a, options.compared);
      std::vector<int> found(of_a.keypoints.size(), 0);
      for (const std::size_t b : others) {
        const Eigen::Vector2d shift = background.shift[b] - background.shift[a];
        std::vector<char> here(of_a.keypoints.size(), 0);
        for (std::size_t d = 0; d < of_a.descriptors.size(); ++d) {
          const auto k = static_cast<std::size_t>(of_a.keypoint_of[d]);
          indices[b]->each_similar(of_a.descriptors[d], of_a.keypoints[k] + shift, radius, options.max_distance,
                                   [&](const Eigen::Vector2d&) { here[k] = 1; });
        }
        for (std::size_t k = 0; k < here.size(); ++k) found[k] += here[k];
      }
      const double needed =
          std::max<double>(options.min_pictures, options.min_share * static_cast<double>(others.size()));
      for (std::size_t k = 0; k < found.size(); ++k) background.still[a][k] = found[k] >= needed ? 1 : 0;
      seen[m] = has_background(of_a, background.still[a], options) ? 1 : 0;
      background.still[a] = touches_still(of_a, background.still[a], options);
    });
    if (2 * static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1)) > members.size())
      for (const std::size_t i : members) background.motion[i] = Motion::turn;
  }
  return background;
}

Features without_still(const Features& features, const std::vector<char>& still) {
  Features kept;
  kept.width = features.width;
  kept.height = features.height;
  std::vector<int> new_place(features.keypoints.size(), -1);
  for (std::size_t k = 0; k < features.keypoints.size(); ++k) {
    if (still[k] != 0) continue;
    new_place[k] = static_cast<int>(kept.keypoints.size());
    kept.keypoints.push_back(features.keypoints[k]);
    kept.sizes.push_back(features.sizes[k]);
    kept.colours.push_back(features.colours[k]);
  }
  for (std::size_t d = 0; d < features.descriptors.size(); ++d) {
    const int place = new_place[static_cast<std::size_t>(features.keypoint_of[d])];
    if (place < 0) continue;
    kept.descriptors.push_back(features.descriptors[d]);
    kept.keypoint_of.push_back(place);
  }
  return kept;
}

void drop_still_matches(std::vector<Match>& matches, const Features& features_a, const Features& features_b,
                        const Eigen::Vector2d& shift_of_b_against_a, const StillnessOptions& options) {
  const double radius = still_radius(features_a, options);
  std::erase_if(matches, [&](const Match& m) {
    const Eigen::Vector2d moved = features_b.keypoints[static_cast<std::size_t>(m.b)] -
                                  features_a.keypoints[static_cast<std::size_t>(m.a)] - shift_of_b_against_a;
    return moved.norm() <= radius;
  });
}

}  // namespace gyre
