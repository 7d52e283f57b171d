// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/plane_cost.h"

#include "offload/cloud/plane_space.h"
#include "ray_scene.h"

#include <gtest/gtest.h>
#include <bit>
#include <limits>

namespace gyre {
namespace {

using test::RayScene;

constexpr float no_limit = std::numeric_limits<float>::max();

// The middle view of five and the sphere's true plane at a pixel of it.
class PlaneCosts : public testing::Test {
 protected:
  static constexpr int x = 48;
  static constexpr int y = 60;

  SlantedPlane true_plane() const {
    const StereoDepth truth = test::true_depth(scene_, views_[2]);
    const std::size_t i = truth.index(x, y);
    return PlaneSpace(views_[2], 0, scene_.region(), 3.0F).plane_from(x, y, 1.0F / truth.depth[i], truth.normal[i]);
  }
  SlantedPlane off_by(float pixels) const {
    SlantedPlane plane = true_plane();
    plane.inverse += pixels * cost_.pixel_step();
    return plane;
  }

  RayScene scene_;
  std::vector<StereoView> views_ = test::views_on_arc(scene_, 5, 9.0, 96);
  std::vector<int> neighbours_{0, 1, 3, 4};
  PlaneCost cost_{views_, 2, neighbours_, 0, {}, {}};
};

TEST_F(PlaneCosts, TheTruePlaneCostsLeast) {
  const PlaneSite site = cost_.site(x, y, cost_.all());
  const float truth = cost_.judge(site, true_plane(), no_limit);
  EXPECT_LT(truth, 0.15F);
  for (const float pixels : {-4.0F, -1.0F, 1.0F, 4.0F}) EXPECT_GT(cost_.judge(site, off_by(pixels), no_limit), truth);
}

TEST_F(PlaneCosts, ALimitEndsEarlyAndNeverBelowIt) {
  const PlaneSite site = cost_.site(x, y, cost_.all());
  const float bad = cost_.judge(site, off_by(4), no_limit);
  EXPECT_FLOAT_EQ(cost_.judge(site, off_by(4), 1.01F * bad), bad);
  EXPECT_GE(cost_.judge(site, off_by(4), 0.5F * bad), 0.5F * bad);
}

// A view in which something else stands at the place is not among those that are kept.
TEST_F(PlaneCosts, TheBestNeighboursAreKept) {
  const Camera camera = test::test_camera(96);
  RayScene other;
  other.centre.x() += 0.11;
  views_[0] = make_stereo_view("other", other.picture(camera, views_[0].cam_from_world), camera,
                               views_[0].cam_from_world, camera.height, 2);
  const PlaneCost cost(views_, 2, neighbours_, 0, {}, {});
  const PlaneCost::Ranking ranking = cost.rank(cost.site(x, y, cost.all()), true_plane(), 3);
  EXPECT_EQ(ranking.best, 0b1110);
  EXPECT_FLOAT_EQ(cost.judge(cost.site(x, y, ranking.best), true_plane(), no_limit), ranking.cost);
}

TEST_F(PlaneCosts, DepthsThatLeadElsewhereCost) {
  std::vector<std::vector<float>> depths;
  for (const StereoView& view : views_) depths.push_back(test::true_depth(scene_, view).depth);
  const PlaneSite site = cost_.site(x, y, cost_.all());
  const float photometric = cost_.judge(site, true_plane(), no_limit);
  const PlaneCost judged(views_, 2, neighbours_, 0, {}, depths);
  EXPECT_NEAR(judged.judge(site, true_plane(), no_limit), photometric, 0.1F);
  for (std::vector<float>& map : depths)
    for (float& depth : map) depth *= 1.05F;
  EXPECT_GT(judged.judge(site, true_plane(), no_limit), photometric + 0.2F);
}

}  // namespace
}  // namespace gyre
