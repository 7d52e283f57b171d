// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/free_space.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>

namespace gyre {
namespace {

// What a view needs to vote.
struct Voter {
  const StereoDepth* map;
  Eigen::Matrix3f rotation;  // camera from world
  Eigen::Vector3f translation;
  Eigen::Vector3f eye;
  float fx, fy, cx, cy;  // to array indices
};

// +1: agrees, -1: sees through, 0: cannot say.
int vote(const Voter& voter, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
         const FreeSpaceOptions& options) {
  const Eigen::Vector3f to_eye = voter.eye - point;
  if (normal.dot(to_eye) < static_cast<float>(options.min_facing) * to_eye.norm()) return 0;
  const Eigen::Vector3f there = voter.rotation * point + voter.translation;
  if (!(there.z() > 0)) return 0;
  const float u = voter.fx * there.x() / there.z() + voter.cx + 0.5F;
  const float v = voter.fy * there.y() / there.z() + voter.cy + 0.5F;
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(voter.map->width) && v < static_cast<float>(voter.map->height))) {
    return 0;
  }
  const std::size_t i = voter.map->index(static_cast<int>(u), static_cast<int>(v));
  const PixelState state = voter.map->state[i];
  if (state == PixelState::unknown || (state == PixelState::surface && voter.map->cost[i] > options.max_cost)) return 0;
  const float behind = (voter.map->depth[i] - there.z()) / there.z();
  if (behind > static_cast<float>(options.clearance)) return -1;
  return std::abs(behind) < static_cast<float>(options.agreement) ? 1 : 0;
}

}  // namespace

std::vector<char> outside_free_space(const PointCloud& cloud, std::span<const StereoView> views,
                                     std::span<const StereoDepth> maps, const FreeSpaceOptions& options, int threads) {
  std::vector<Voter> voters;
  for (std::size_t j = 0; j < views.size(); ++j) {
    const Pose& pose = views[j].cam_from_world;
    const Eigen::Matrix3d& k = views[j].levels[0].index_from_camera;
    voters.push_back({&maps[j], pose.rotation.toRotationMatrix().cast<float>(), pose.translation.cast<float>(),
                      centre_of(pose).cast<float>(), static_cast<float>(k(0, 0)), static_cast<float>(k(1, 1)),
                      static_cast<float>(k(0, 2)), static_cast<float>(k(1, 2))});
  }
  constexpr std::size_t block = 4096;
  std::vector<char> keep(cloud.points.size(), 0);
  parallel_for((keep.size() + block - 1) / block, threads, [&](std::size_t b) {
    for (std::size_t i = b * block; i < std::min(keep.size(), (b + 1) * block); ++i) {
      int balance = 0;
      for (const Voter& voter : voters) balance += vote(voter, cloud.points[i], cloud.normals[i], options);
      keep[i] = balance > 0 ? 1 : 0;
    }
  });
  return keep;
}

}  // namespace gyre
