// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_match.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>

namespace gyre {
namespace {

using test::RayScene;

// Errors over the sphere's pixels, without its outermost rim, where a pixel sees the surface at less than 20 degrees.
struct Errors {
  double median_depth = 0;      // share of the depth
  double share_within_1pc = 0;  // of depth
  double median_normal_deg = 0;
};

Errors compare(const StereoDepth& found, const StereoDepth& truth) {
  std::vector<double> depth;
  std::vector<double> angle;
  for (std::size_t i = 0; i < truth.state.size(); ++i) {
    if (truth.state[i] != PixelState::surface || truth.normal[i].z() > -0.35F) continue;
    const bool known = found.state[i] == PixelState::surface;
    depth.push_back(known ? std::abs(found.depth[i] / truth.depth[i] - 1.0) : 1.0);
    angle.push_back(known ? std::acos(std::min(1.0F, found.normal[i].dot(truth.normal[i]))) * 57.29578 : 180.0);
  }
  const auto within = std::count_if(depth.begin(), depth.end(), [](double d) { return d < 0.01; });
  const double share = static_cast<double>(within) / static_cast<double>(depth.size());
  std::nth_element(depth.begin(), depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2), depth.end());
  std::nth_element(angle.begin(), angle.begin() + static_cast<std::ptrdiff_t>(angle.size() / 2), angle.end());
  return {depth[depth.size() / 2], share, angle[angle.size() / 2]};
}

TEST(PatchMatch, FindsDepthAndNormalOfASphere) {
  const RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 5, 9.0, 128);
  const std::vector<int> neighbours{0, 1, 3, 4};
  const StereoDepth found = estimate_depth(views, 2, neighbours, scene.region(), {}, 7);
  const Errors errors = compare(found, test::true_depth(scene, views[2]));
  EXPECT_LT(errors.median_depth, 0.0025);
  EXPECT_GT(errors.share_within_1pc, 0.9);
  EXPECT_LT(errors.median_normal_deg, 12.0);
}

TEST(PatchMatch, GeometricPassImprovesTheMap) {
  const RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 3, 9.0, 96);
  const std::vector<std::vector<int>> neighbours{{1, 2}, {0, 2}, {1, 0}};
  std::vector<StereoDepth> maps;
  for (int i = 0; i < 3; ++i) maps.push_back(estimate_depth(views, i, neighbours[i], scene.region(), {}, i));
  std::vector<std::vector<float>> depths;
  for (const StereoDepth& map : maps) depths.push_back(map.depth);
  const StereoDepth refined = refine_depth(views, depths, maps[1], 1, neighbours[1], scene.region(), {}, 1);
  const StereoDepth truth = test::true_depth(scene, views[1]);
  EXPECT_LT(compare(refined, truth).median_depth, compare(maps[1], truth).median_depth);
  EXPECT_GE(compare(refined, truth).share_within_1pc, compare(maps[1], truth).share_within_1pc);
}

TEST(PatchMatch, SameSeedSameMap) {
  const RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 3, 9.0, 64);
  const std::vector<int> neighbours{0, 2};
  const StereoDepth a = estimate_depth(views, 1, neighbours, scene.region(), {}, 5);
  const StereoDepth b = estimate_depth(views, 1, neighbours, scene.region(), {}, 5);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.cost, b.cost);
}

TEST(PatchMatch, ViewWithoutNeighboursOrRegionKnowsNothing) {
  const RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 2, 9.0, 64);
  const auto nothing = [](const StereoDepth& map) {
    return std::all_of(map.state.begin(), map.state.end(), [](PixelState s) { return s == PixelState::unknown; });
  };
  EXPECT_TRUE(nothing(estimate_depth(views, 0, {}, scene.region(), {}, 1)));
  const SubjectRegion behind{Eigen::Vector3d(-1, 0, 5), Eigen::Vector3d(1, 2, 6)};
  const std::vector<int> neighbours{1};
  EXPECT_TRUE(nothing(estimate_depth(views, 0, neighbours, behind, {}, 1)));
}

}  // namespace
}  // namespace gyre
