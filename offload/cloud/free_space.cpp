// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/free_space.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace gyre {
namespace {

constexpr std::size_t block = 4096;  // points a thread takes at once

// A view with what it needs to be asked often.
class Voter {
 public:
  Voter(const StereoView& view, const StereoDepth& map)
      : map_(&map),
        rotation_(view.cam_from_world.rotation.toRotationMatrix().cast<float>()),
        translation_(view.cam_from_world.translation.cast<float>()),
        eye_(centre_of(view.cam_from_world).cast<float>()) {
    const Eigen::Matrix3d& k = view.levels[0].index_from_camera;
    fx_ = static_cast<float>(k(0, 0));
    fy_ = static_cast<float>(k(1, 1));
    cx_ = static_cast<float>(k(0, 2));
    cy_ = static_cast<float>(k(1, 2));
  }

  // How far behind the point the view's surface lies, as a share of the point's depth; negative before it. Nothing
  // where the view has no surface it is sure of.
  std::optional<float> behind(const Eigen::Vector3f& point, float max_cost) const {
    const Eigen::Vector3f there = rotation_ * point + translation_;
    if (!(there.z() > 0)) return std::nullopt;
    const float u = fx_ * there.x() / there.z() + cx_ + 0.5F;
    const float v = fy_ * there.y() / there.z() + cy_ + 0.5F;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(map_->width) && v < static_cast<float>(map_->height)))
      return std::nullopt;
    const std::size_t i = map_->index(static_cast<int>(u), static_cast<int>(v));
    const PixelState state = map_->state[i];
    if (state == PixelState::unknown || (state == PixelState::surface && map_->cost[i] > max_cost)) return std::nullopt;
    return (map_->depth[i] - there.z()) / there.z();
  }

  // +1: agrees, -1: sees through, 0: cannot say.
  int vote(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, const FreeSpaceOptions& options) const {
    const Eigen::Vector3f to_eye = eye_ - point;
    if (normal.dot(to_eye) < static_cast<float>(options.min_facing) * to_eye.norm()) return 0;
    const std::optional<float> distance = behind(point, options.max_cost);
    if (!distance) return 0;
    if (*distance > static_cast<float>(options.clearance)) return -1;
    return std::abs(*distance) < static_cast<float>(options.agreement) ? 1 : 0;
  }

 private:
  const StereoDepth* map_;
  Eigen::Matrix3f rotation_;  // camera from world
  Eigen::Vector3f translation_;
  Eigen::Vector3f eye_;
  float fx_, fy_, cx_, cy_;  // to array indices
};

std::vector<Voter> voters_of(std::span<const StereoView> views, std::span<const StereoDepth> maps) {
  std::vector<Voter> voters;
  for (std::size_t j = 0; j < views.size(); ++j) voters.emplace_back(views[j], maps[j]);
  return voters;
}

}  // namespace

std::vector<char> outside_free_space(const PointCloud& cloud, std::span<const StereoView> views,
                                     std::span<const StereoDepth> maps, const FreeSpaceOptions& options, int threads) {
  const std::vector<Voter> voters = voters_of(views, maps);
  std::vector<char> keep(cloud.points.size(), 0);
  parallel_for((keep.size() + block - 1) / block, threads, [&](std::size_t b) {
    for (std::size_t i = b * block; i < std::min(keep.size(), (b + 1) * block); ++i) {
      int balance = 0;
      for (const Voter& voter : voters) balance += voter.vote(cloud.points[i], cloud.normals[i], options);
      keep[i] = balance > 0 ? 1 : 0;
    }
  });
  return keep;
}

PointViews views_that_see(const PointCloud& cloud, std::span<const StereoView> views, std::span<const StereoDepth> maps,
                          const FreeSpaceOptions& options, int threads) {
  const std::vector<Voter> voters = voters_of(views, maps);
  const std::size_t count = cloud.points.size();
  std::vector<PointViews> parts((count + block - 1) / block);
  parallel_for(parts.size(), threads, [&](std::size_t b) {
    for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) {
      for (std::size_t j = 0; j < voters.size(); ++j) {
        if (voters[j].vote(cloud.points[i], cloud.normals[i], options) > 0)
          parts[b].view.push_back(static_cast<std::uint16_t>(j));
      }
      parts[b].first.push_back(static_cast<std::uint32_t>(parts[b].view.size()));
    }
  });
  PointViews seen;
  for (const PointViews& part : parts) {
    const auto before = static_cast<std::uint32_t>(seen.view.size());
    for (std::size_t i = 1; i < part.first.size(); ++i) seen.first.push_back(before + part.first[i]);
    seen.view.insert(seen.view.end(), part.view.begin(), part.view.end());
  }
  return seen;
}

SightCount count_sight(const Eigen::Vector3d& point, std::span<const StereoView> views,
                       std::span<const StereoDepth> maps, const FreeSpaceOptions& options) {
  SightCount count;
  for (std::size_t j = 0; j < views.size(); ++j) {
    const std::optional<float> behind = Voter(views[j], maps[j]).behind(point.cast<float>(), options.max_cost);
    if (!behind) continue;
    ++(*behind > static_cast<float>(options.clearance) ? count.through : count.blocked);
  }
  return count;
}

}  // namespace gyre
