// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/seed.h"

#include "common/parallel/parallel.h"
#include "offload/cameras/verification.h"

namespace gyre {

namespace {

std::optional<RelativePose> pose_of(const Scene& scene, const ViewPair& pair, double max_error) {
  const View& a = scene.views[static_cast<std::size_t>(pair.a)];
  const View& b = scene.views[static_cast<std::size_t>(pair.b)];
  const double unit = 0.5 * (scene.camera_of(a).fx + scene.camera_of(b).fx);
  return relative_pose(a.normalised, b.normalised, pair.matches, max_error / unit);
}

}  // namespace

std::vector<ViewPair> rank_seed_pairs(const Scene& scene, std::span<const ViewPair> pairs, const SeedOptions& options,
                                      int threads) {
  std::vector<const ViewPair*> candidates;
  for (const ViewPair& pair : pairs) candidates.push_back(&pair);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const ViewPair* x, const ViewPair* y) { return x->matches.size() > y->matches.size(); });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(options.candidates)));

  std::vector<double> score(candidates.size(), 0.0);
  parallel_for(candidates.size(), threads, [&](std::size_t i) {
    const auto pose = pose_of(scene, *candidates[i], options.triangulation.max_error);
    if (!pose || static_cast<int>(pose->inliers.size()) < options.min_points) return;
    if (pose->median_angle > options.max_angle) return;
    score[i] = static_cast<double>(pose->inliers.size()) * std::min(pose->median_angle / options.good_angle, 1.0);
  });
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) { return score[x] > score[y]; });
  std::vector<ViewPair> ranked;
  for (const std::size_t i : order)
    if (score[i] > 0) ranked.push_back(*candidates[i]);
  return ranked;
}

bool plant_seed(Scene& scene, const ViewPair& pair, const SeedOptions& options) {
  const auto pose = pose_of(scene, pair, options.triangulation.max_error);
  if (!pose) return false;
  View& a = scene.views[static_cast<std::size_t>(pair.a)];
  View& b = scene.views[static_cast<std::size_t>(pair.b)];
  a.registered = b.registered = true;
  a.cam_from_world = Pose{};
  b.cam_from_world = pose->b_from_a;
  extend_points_of_view(scene, pair.a, options.triangulation);
  const auto points =
      std::count_if(scene.tracks.begin(), scene.tracks.end(), [](const Track& t) { return t.triangulated; });
  return points >= options.min_points;
}

}  // namespace gyre
