// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/consistency.h"

#include "common/parallel/parallel.h"
#include "offload/cameras/rotation_averaging.h"
#include "offload/cameras/verification.h"

#include <cmath>

namespace gyre {

std::vector<std::vector<int>> pairs_of_views(const Scene& scene, std::span<const ViewPair> pairs) {
  std::vector<std::vector<int>> result(scene.views.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    result[static_cast<std::size_t>(pairs[i].a)].push_back(static_cast<int>(i));
    result[static_cast<std::size_t>(pairs[i].b)].push_back(static_cast<int>(i));
  }
  return result;
}

bool are_near(const View& a, const View& b, const ConsistencyOptions& options) {
  return a.pass == b.pass && std::abs(a.order - b.order) <= options.near;
}

bool agrees_with_pairs(const Scene& scene, std::span<const ViewPair> pairs, std::span<const int> pairs_of_view,
                       int view, const ConsistencyOptions& options) {
  double all = 0, all_agreeing = 0, near = 0, near_agreeing = 0;
  for (const int p : pairs_of_view) {
    const ViewPair& pair = pairs[static_cast<std::size_t>(p)];
    const View& self = scene.views[static_cast<std::size_t>(view)];
    const View& other = scene.views[static_cast<std::size_t>(pair.a == view ? pair.b : pair.a)];
    if (!other.registered) continue;
    const auto matches = static_cast<double>(pair.matches.size());
    const double agreeing = matches * epipolar_agreement(scene, pair, options.max_error);
    all += matches;
    all_agreeing += agreeing;
    if (!are_near(self, other, options)) continue;
    near += matches;
    near_agreeing += agreeing;
  }
  return all_agreeing >= options.min_agreement * all && near_agreeing >= options.min_agreement * near;
}

std::vector<ViewPair> consistent_pairs(const Scene& scene, std::span<const ViewPair> pairs,
                                       const ConsistencyOptions& options, int threads) {
  std::vector<ViewPair> checked(pairs.begin(), pairs.end());
  parallel_for(checked.size(), threads, [&](std::size_t i) {
    ViewPair& pair = checked[i];
    const View& a = scene.views[static_cast<std::size_t>(pair.a)];
    const View& b = scene.views[static_cast<std::size_t>(pair.b)];
    if (!a.registered || !b.registered) return;
    const Eigen::Matrix3d essential = essential_matrix(b.cam_from_world * a.cam_from_world.inverse());
    const double max_error = options.max_error / (0.5 * (scene.camera_of(a).fx + scene.camera_of(b).fx));
    const std::size_t before = pair.matches.size();
    std::erase_if(pair.matches, [&](const Match& m) {
      return sampson_distance(essential, a.normalised[static_cast<std::size_t>(m.a)],
                              b.normalised[static_cast<std::size_t>(m.b)]) > max_error;
    });
    if (static_cast<double>(pair.matches.size()) < options.min_agreement * static_cast<double>(before))
      pair.matches.clear();
  });
  std::erase_if(checked, [](const ViewPair& pair) { return pair.matches.empty(); });
  return checked;
}

std::vector<ViewPair> pairs_that_close(const Scene& scene, std::span<const ViewPair> pairs,
                                       const ConsistencyOptions& options, int threads) {
  std::vector<std::optional<RelativeRotation>> measured(pairs.size());
  parallel_for(pairs.size(), threads, [&](std::size_t i) {
    const ViewPair& pair = pairs[i];
    const View& a = scene.views[static_cast<std::size_t>(pair.a)];
    const View& b = scene.views[static_cast<std::size_t>(pair.b)];
    const double max_error = options.max_error / (0.5 * (scene.camera_of(a).fx + scene.camera_of(b).fx));
    const auto pose = relative_pose(a.normalised, b.normalised, pair.matches, max_error);
    if (!pose) return;
    const double trust = are_near(a, b, options) ? options.trust_in_near : 1.0;
    measured[i] = {pair.a, pair.b, pose->b_from_a.rotation, trust * static_cast<double>(pose->inliers.size())};
  });
  std::vector<RelativeRotation> relative;
  for (const auto& m : measured)
    if (m) relative.push_back(*m);
  const RotationAverage average = average_rotations(static_cast<int>(scene.views.size()), relative);
  std::vector<ViewPair> kept;
  std::size_t next = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double turn = measured[i] ? average.disagreement[next++] : 0.0;
    const View& a = scene.views[static_cast<std::size_t>(pairs[i].a)];
    const View& b = scene.views[static_cast<std::size_t>(pairs[i].b)];
    if (turn < options.max_turn || !std::isfinite(turn) || are_near(a, b, options)) kept.push_back(pairs[i]);
  }
  return kept;
}

}  // namespace gyre
