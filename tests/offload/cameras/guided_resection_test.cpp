// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/guided_resection.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr int views = 48;

// Each point of the world has a look of its own; what a view makes of it is mixed with `blur` parts of chance.
Descriptor look(int point, double blur, std::mt19937& chance) {
  std::mt19937 own(static_cast<unsigned>(point));
  std::uniform_real_distribution<float> value(0, 1);
  std::array<float, 128> sift{};
  for (float& x : sift) x = value(own) * value(own) + static_cast<float>(blur) * value(chance);
  return root_sift(sift.data());
}

class GuidedResection : public testing::Test {
 protected:
  GuidedResection() : orbit_(make_orbit({.views = views})), scene_(true_scene(orbit_)), features_(views) {
    std::mt19937 chance(5);
    for (int v = 0; v < views; ++v) {
      Features& f = features_[v];
      f.keypoints = scene_.views[v].keypoints;
      for (std::size_t k = 0; k < f.keypoints.size(); ++k) {
        f.descriptors.push_back(look(orbit_.point_of[v][k], 0.2, chance));
        f.keypoint_of.push_back(static_cast<int>(k));
      }
    }
  }

  // As if nothing had matched the view.
  void lose(int v) {
    scene_.views[v].registered = false;
    scene_.views[v].cam_from_world = {};
    scene_.views[v].track_of.assign(scene_.views[v].keypoints.size(), -1);
    for (Track& track : scene_.tracks)
      std::erase_if(track.observations, [&](const Observation& o) { return o.view == v; });
  }
  double centre_error(int v) const {
    return (centre_of(scene_.views[v].cam_from_world) - centre_of(orbit_.cam_from_world[v])).norm();
  }

  Orbit orbit_;
  Scene scene_;
  std::vector<Features> features_;
};

TEST_F(GuidedResection, FindsThreeLostViewsInARow) {
  for (const int v : {20, 21, 22}) lose(v);
  EXPECT_EQ(place_between_neighbours(scene_, features_), (std::vector<int>{20, 21, 22}));
  for (const int v : {20, 21, 22}) {
    EXPECT_TRUE(scene_.views[v].registered);
    EXPECT_LT(centre_error(v), 0.005) << v;
  }
}

TEST_F(GuidedResection, PlacedViewsJoinTheTracks) {
  lose(30);
  ASSERT_EQ(place_between_neighbours(scene_, features_).size(), 1U);
  int seen = 0;
  for (const Track& track : scene_.tracks) {
    EXPECT_TRUE(std::is_sorted(track.observations.begin(), track.observations.end(),
                               [](const Observation& a, const Observation& b) { return a.view < b.view; }));
    for (const Observation& o : track.observations) {
      if (o.view != 30) continue;
      EXPECT_TRUE(o.used);
      EXPECT_LT(reprojection_error(scene_, o, track.point), 8.0);
      ++seen;
    }
  }
  EXPECT_GT(seen, 100);
}

TEST_F(GuidedResection, LeavesOutAPictureOfSomethingElse) {
  lose(10);
  std::mt19937 chance(9);
  for (Descriptor& d : features_[10].descriptors) d = look(static_cast<int>(100'000 + chance() % 100'000), 0.2, chance);
  EXPECT_TRUE(place_between_neighbours(scene_, features_).empty());
  EXPECT_FALSE(scene_.views[10].registered);
}

TEST_F(GuidedResection, NeedsNeighboursOnBothSides) {
  lose(0);
  lose(47);
  EXPECT_TRUE(place_between_neighbours(scene_, features_).empty());
}

}  // namespace
}  // namespace gyre
