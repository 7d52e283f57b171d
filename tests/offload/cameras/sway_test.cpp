// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/sway.h"

#include "offload/cameras/bundle_adjustment.h"
#include "offload/cameras/reconstruction.h"
#include "offload/cameras/world_frame.h"
#include "tests/offload/cameras/orbit_scene.h"

#include <gtest/gtest.h>
#include <cmath>

namespace gyre {
namespace {

const Eigen::AlignedBox3d subject(Eigen::Vector3d(-0.6, -0.05, -0.6), Eigen::Vector3d(0.6, 1.85, 0.6));

// Standing people sway by some millimetres, more forwards and backwards, hardly up and down.
std::vector<Eigen::Vector3d> swaying(int views, double amplitude) {
  std::vector<Eigen::Vector3d> sway;
  for (int v = 0; v < views; ++v)
    sway.emplace_back(amplitude * std::sin(1.7 * v), 0.1 * amplitude * std::cos(2.9 * v),
                      amplitude * std::cos(2.3 * v + 0.4));
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& s : sway) mean += s / views;
  for (Eigen::Vector3d& s : sway) s -= mean;
  return sway;
}

Orbit orbit_with(double amplitude) {
  OrbitOptions options;
  options.sway = swaying(options.views, amplitude);
  return make_orbit(options);
}

// Bundle adjustment lets the cameras follow the subject, as it does in the stage.
Scene adjusted(const Orbit& orbit) {
  Scene scene = true_scene(orbit);
  BundleOptions options;
  options.lens = LensFreedom::fixed;
  adjust_bundle(scene, options);
  return scene;
}

// Root mean square of the errors in space, and the largest one parallel to the picture; metres.
struct SwayError {
  double rms = 0;
  double worst_seen = 0;
};
SwayError error_of(const std::vector<ViewSway>& found, const Orbit& orbit, const std::vector<Eigen::Vector3d>& truth) {
  SwayError error;
  for (const ViewSway& view : found) {
    const auto v = static_cast<std::size_t>(view.view);
    const Eigen::Vector3d difference = orbit.cam_from_world[v].rotation * (view.shift - truth[v]);
    error.rms += difference.squaredNorm() / static_cast<double>(found.size());
    error.worst_seen = std::max(error.worst_seen, difference.head<2>().norm());
  }
  error.rms = std::sqrt(error.rms);
  return error;
}

TEST(Sway, of_four_millimetres_is_found_within_one) {
  const Orbit orbit = orbit_with(0.004);
  const std::vector<ViewSway> found = estimate_sway(adjusted(orbit), subject);
  ASSERT_EQ(found.size(), 24U);
  const SwayError error = error_of(found, orbit, swaying(24, 0.004));
  EXPECT_LT(error.rms, 0.001);
  EXPECT_LT(error.worst_seen, 0.001);
  EXPECT_NEAR(median_sway(found), 0.004, 0.001);
  for (const ViewSway& view : found) {
    EXPECT_GT(view.deviation, 0.5 * error.rms);
    EXPECT_LT(view.deviation, 2 * error.rms);
    EXPECT_GT(view.subject_count, 80);
    EXPECT_GT(view.background_count, 100);
    EXPECT_LT(view.background_error, 0.5);
  }
}

TEST(Sway, is_found_after_a_whole_reconstruction) {
  const Orbit orbit = orbit_with(0.004);
  Scene scene = orbit.scene;
  ASSERT_TRUE(reconstruct(scene, orbit.pairs, {}, [](double, std::string_view) {}));
  std::vector<Eigen::Vector3d> truth, centres;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    truth.push_back(centre_of(orbit.cam_from_world[v]));
    centres.push_back(centre_of(scene.views[v].cam_from_world));
  }
  const auto truth_from_scene = align_points(truth, centres);
  ASSERT_TRUE(truth_from_scene);
  move_world(scene, *truth_from_scene);
  const SwayError error = error_of(estimate_sway(scene, subject), orbit, swaying(24, 0.004));
  EXPECT_LT(error.rms, 0.001);
  EXPECT_LT(error.worst_seen, 0.001);
}

TEST(Sway, of_a_still_subject_is_hardly_anything) {
  const Orbit orbit = orbit_with(0.0);
  const std::vector<ViewSway> found = estimate_sway(adjusted(orbit), subject);
  ASSERT_EQ(found.size(), 24U);
  EXPECT_LT(median_sway(found), 0.001);
  for (const ViewSway& view : found) EXPECT_LT(view.subject_error, 0.8);
}

TEST(Sway, needs_a_room) {
  OrbitOptions options;
  options.room_points = 0;
  options.floor_points = 0;
  EXPECT_TRUE(estimate_sway(true_scene(make_orbit(options)), subject).empty());
}

TEST(Sway, is_written_by_name_in_millimetres) {
  const std::vector<ViewSway> sway = {{1, Eigen::Vector3d(0.001, 0, -0.002), 0.0005, 1.5, 0.4, 120, 200}};
  EXPECT_EQ(to_json(sway, std::vector<std::string>{"body-000000.jpg", "body-000010.jpg"}),
            nlohmann::json::parse(R"([{"name":"body-000010.jpg","sway_mm":[1.0,0.0,-2.0],"std_mm":0.5,
                                       "subject_px":1.5,"background_px":0.4,"subject_features":120,
                                       "background_features":200}])"));
}

}  // namespace
}  // namespace gyre
