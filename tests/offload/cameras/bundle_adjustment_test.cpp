// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/bundle_adjustment.h"

#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

OrbitOptions exact_ring() {
  OrbitOptions options;
  options.views = 16;
  options.pixel_noise = 0;
  options.outlier_share = 0;
  return options;
}

BundleOptions thorough() {
  BundleOptions options;
  options.tolerance = 1e-14;
  options.max_iterations = 100;
  return options;
}

TEST(BundleAdjustment, leaves_the_truth_where_it_is) {
  const Orbit orbit = make_orbit(exact_ring());
  Scene scene = true_scene(orbit);
  BundleOptions options = thorough();
  options.lens = LensFreedom::fixed;
  const BundleSummary summary = adjust_bundle(scene, options);
  EXPECT_LT(summary.initial_cost, 1e-12);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    EXPECT_LT((scene.views[v].cam_from_world.translation - orbit.cam_from_world[v].translation).norm(), 1e-9);
    EXPECT_LT(angle_between(scene.views[v].cam_from_world.rotation, orbit.cam_from_world[v].rotation), 1e-9);
  }
}

TEST(BundleAdjustment, brings_disturbed_poses_and_points_back) {
  const Orbit orbit = make_orbit(exact_ring());
  Scene scene = true_scene(orbit);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    Pose& pose = scene.views[v].cam_from_world;
    const double sign = v % 2 == 0 ? 1 : -1;
    pose.rotation = Eigen::AngleAxisd(0.01 * sign, Eigen::Vector3d(1, 2, 3).normalized()) * pose.rotation;
    pose.translation += Eigen::Vector3d(0.01, -0.02 * sign, 0.015);
  }
  for (std::size_t t = 0; t < scene.tracks.size(); ++t)
    scene.tracks[t].point += 0.01 * Eigen::Vector3d(std::sin(1.0 * t), std::cos(2.0 * t), std::sin(3.0 * t));
  BundleOptions options = thorough();
  options.lens = LensFreedom::fixed;
  const BundleSummary summary = adjust_bundle(scene, options);
  EXPECT_LT(summary.final_cost, 1e-6);
  EXPECT_LT(largest_centre_error(orbit, scene), 1e-5);
}

TEST(BundleAdjustment, finds_a_usual_lens_exactly) {
  OrbitOptions usual = exact_ring();
  usual.camera = {.width = 720, .height = 1280, .fx = 1100, .fy = 1100, .cx = 360, .cy = 640};
  const Orbit orbit = make_orbit(usual);
  Scene scene = true_scene(orbit);
  scene.cameras[0] = Camera{.width = 720, .height = 1280, .fx = 1000, .fy = 1010, .cx = 350, .cy = 650, .k1 = -0.02};
  BundleOptions options = thorough();
  options.lens = LensFreedom::tangential;
  adjust_bundle(scene, options);
  const Camera& found = scene.cameras[0];
  EXPECT_NEAR(found.fx, 1100, 0.01);
  EXPECT_NEAR(found.fy, 1100, 0.01);
  EXPECT_NEAR(found.cx, 360, 0.01);
  EXPECT_NEAR(found.cy, 640, 0.01);
  EXPECT_NEAR(found.k1, 0, 1e-5);
  EXPECT_NEAR(found.k2, 0, 1e-5);
}

// Away from the usual lens the priors pull, so that the lens is found to a share of their width only.
TEST(BundleAdjustment, finds_an_unusual_lens_nearly) {
  OrbitOptions noisy = exact_ring();
  noisy.pixel_noise = 0.1;
  const Orbit orbit = make_orbit(noisy);
  Scene scene = true_scene(orbit);
  const Camera& truth = orbit.camera;
  scene.cameras[0] = Camera{.width = 720, .height = 1280, .fx = 1000, .fy = 1000, .cx = 360, .cy = 640};
  BundleOptions options = thorough();
  options.lens = LensFreedom::principal;
  adjust_bundle(scene, options);
  const Camera& found = scene.cameras[0];
  EXPECT_NEAR(found.fx, truth.fx, 0.003 * truth.fx);
  EXPECT_NEAR(found.fy, truth.fy, 0.003 * truth.fy);
  EXPECT_NEAR(found.cx, truth.cx, 3.0);
  EXPECT_NEAR(found.cy, truth.cy, 3.0);
  EXPECT_NEAR(found.k1, truth.k1, 0.01);
  EXPECT_EQ(found.p1, 0.0);
}

TEST(BundleAdjustment, moves_only_the_views_that_are_free) {
  const Orbit orbit = make_orbit(exact_ring());
  Scene scene = true_scene(orbit);
  const Pose truth = scene.views[5].cam_from_world;
  scene.views[5].cam_from_world.translation += Eigen::Vector3d(0.02, 0.01, -0.02);
  scene.views[6].cam_from_world.translation += Eigen::Vector3d(0.001, 0, 0);
  const Pose disturbed = scene.views[6].cam_from_world;
  BundleOptions options = thorough();
  options.lens = LensFreedom::fixed;
  options.free_views = {5};
  options.free_points = false;
  adjust_bundle(scene, options);
  EXPECT_LT((scene.views[5].cam_from_world.translation - truth.translation).norm(), 1e-7);
  EXPECT_EQ(scene.views[6].cam_from_world.translation, disturbed.translation);
}

TEST(BundleAdjustment, a_limit_of_points_leaves_every_view_enough) {
  const Orbit orbit = make_orbit(exact_ring());
  Scene scene = true_scene(orbit);
  BundleOptions all = thorough();
  BundleOptions few = all;
  few.max_points_per_view = 50;
  const int all_observations = adjust_bundle(scene, all).observations;
  const int few_observations = adjust_bundle(scene, few).observations;
  EXPECT_LT(few_observations, all_observations / 2);
  EXPECT_GE(few_observations, 50 * 16);
}

}  // namespace
}  // namespace gyre
