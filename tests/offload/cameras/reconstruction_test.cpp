// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/reconstruction.h"

#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const Progress silent = [](double, std::string_view) {};

TEST(Reconstruction, a_ring_closes_and_finds_its_lens) {
  const Orbit orbit = make_orbit();
  Scene scene = orbit.scene;
  const auto summary = reconstruct(scene, orbit.pairs, {}, silent);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->registered, 24);
  EXPECT_LT(summary->rms_error, 0.6);
  EXPECT_LT(largest_centre_error(orbit, scene), 0.004);
  EXPECT_NEAR(scene.cameras[0].fx, orbit.camera.fx, 0.004 * orbit.camera.fx);
}

TEST(Reconstruction, a_claimed_focal_length_helps_and_a_wrong_one_does_no_harm) {
  OrbitOptions small;
  small.views = 12;
  small.arc = 3.0;
  const Orbit orbit = make_orbit(small);
  const double truth = orbit.camera.fx / orbit.camera.height;
  for (const double claimed : {1.03 * truth, 2.5 * truth}) {
    Scene scene = orbit.scene;
    ReconstructionOptions options;
    options.known_guess = claimed;
    ASSERT_TRUE(reconstruct(scene, orbit.pairs, options, silent));
    EXPECT_NEAR(scene.cameras[0].fx, orbit.camera.fx, 0.01 * orbit.camera.fx) << claimed;
    EXPECT_LT(largest_centre_error(orbit, scene), 0.01) << claimed;
  }
}

TEST(Reconstruction, does_not_depend_on_threads) {
  OrbitOptions small;
  small.views = 10;
  small.arc = 2.5;
  const Orbit orbit = make_orbit(small);
  Scene one = orbit.scene, three = orbit.scene;
  ReconstructionOptions options;
  options.threads = 1;
  ASSERT_TRUE(reconstruct(one, orbit.pairs, options, silent));
  options.threads = 3;
  ASSERT_TRUE(reconstruct(three, orbit.pairs, options, silent));
  for (std::size_t v = 0; v < one.views.size(); ++v) {
    EXPECT_EQ(one.views[v].cam_from_world.translation, three.views[v].cam_from_world.translation);
    EXPECT_EQ(one.views[v].cam_from_world.rotation.coeffs(), three.views[v].cam_from_world.rotation.coeffs());
  }
}

TEST(Reconstruction, a_known_lens_stays) {
  OrbitOptions small;
  small.views = 10;
  small.arc = 2.5;
  const Orbit orbit = make_orbit(small);
  Scene scene = orbit.scene;
  scene.cameras[0] = orbit.camera;
  ReconstructionOptions options;
  options.known_lens = true;
  const auto summary = reconstruct(scene, orbit.pairs, options, silent);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->registered, 10);
  EXPECT_EQ(scene.cameras[0].fx, orbit.camera.fx);
  EXPECT_EQ(scene.cameras[0].k1, orbit.camera.k1);
  EXPECT_LT(largest_centre_error(orbit, scene), 0.004);
}

TEST(Reconstruction, repeated_texture_misplaces_no_view) {
  // Pictures at opposite places of the ring seem to see the same wall.
  OrbitOptions options;
  const Orbit orbit = make_orbit(options);
  std::vector<ViewPair> pairs = orbit.pairs;
  for (int v = 0; v < 12; v += 2) {
    ViewPair wrong{v, v + 12, {}};
    // The keypoints of the opposite view lie where those of the next view would.
    for (const ViewPair& pair : orbit.pairs)
      if (pair.a == v && pair.b == v + 1)
        for (const Match& m : pair.matches)
          if (m.b < static_cast<int>(orbit.scene.views[static_cast<std::size_t>(v + 12)].keypoints.size()) &&
              m.b % 5 == 0)
            wrong.matches.push_back(m);
    pairs.push_back(wrong);
  }
  Scene scene = orbit.scene;
  const auto summary = reconstruct(scene, pairs, {}, silent);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->registered, 24);
  EXPECT_LT(largest_centre_error(orbit, scene), 0.005);
}

TEST(Reconstruction, matches_of_no_scene_are_an_error_that_says_what_to_do) {
  const Orbit orbit = make_orbit();
  std::vector<ViewPair> pairs;
  for (int v = 0; v + 1 < 24; ++v) {
    ViewPair random{v, v + 1, {}};
    for (int i = 0; i < 60; ++i) random.matches.push_back({i, (i * 37 + v) % 60});
    pairs.push_back(random);
  }
  Scene scene = orbit.scene;
  const auto summary = reconstruct(scene, pairs, {}, silent);
  ASSERT_FALSE(summary);
  EXPECT_NE(summary.error().message().find("walk slowly"), std::string::npos);
}

}  // namespace
}  // namespace gyre
