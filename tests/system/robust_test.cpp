// SPDX-License-Identifier: Apache-2.0
// Walks as they really happen, rendered with exact truth: the cameras are found and the cloud is the subject's, or the
// operator is told what to do.
#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/cloud/cloud_stage.h"
#include "offload/report/surface_errors.h"
#include "tests/system/rendered_bundle.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <numeric>

namespace gyre {
namespace {

using synthetic::Capture;
using synthetic::CaptureOptions;
using synthetic::make_capture;
using synthetic::Material;

// Of the walk without any trouble, as measured; trouble may cost what is said here and no more.
constexpr double clean_median_mm = 0.4;
constexpr double clean_largest_mm = 1.0;
constexpr double misplaced_mm = 15.0;

CameraFigures figures_of(const RenderedBundle& rendered) {
  const auto figures = place_cameras(rendered);
  EXPECT_TRUE(figures) << figures.error().message();
  if (!figures) return {};
  std::puts(to_text(*figures).c_str());
  std::fflush(stdout);
  return *figures;
}

// Every keyframe has its camera, none is misplaced, and the world is upright on the floor around the subject.
void expect_sound(const CameraFigures& figures) {
  EXPECT_EQ(figures.registered, figures.total);
  EXPECT_LT(figures.median_mm, 3 * clean_median_mm);
  EXPECT_LT(figures.largest_mm, misplaced_mm);
  EXPECT_LT(figures.axis_mm, 50);
  EXPECT_LT(figures.tilt_deg, 0.5);
  EXPECT_LT(std::abs(figures.floor_mm), 10);
  EXPECT_LT(std::abs(figures.scale_percent), 4);
}

void expect_closed(const CameraFigures& figures) {
  ASSERT_TRUE(figures.scene.contains("ring"));
  EXPECT_TRUE(figures.scene["ring"]["closed"]);
  EXPECT_NEAR(figures.scene["ring"]["covered_deg"], 360, 1e-6);
}

// Shares of the surface of these materials that the cloud has a point for, and of the cloud near it that is right.
struct CloudFigures {
  double covered = 0.0;  // of the surface within 15 mm of a point
  double right = 0.0;    // of the points nearest to it, within 30 mm: six pixels at the size that is used here
  std::size_t points = 0;
};

CloudFigures measure(const PointCloud& cloud, const Similarity& truth_from_world, const synthetic::Subject& subject,
                     const std::function<bool(Material)>& wanted) {
  TriangleMesh part = subject.mesh, rest = subject.mesh;
  part.triangles.clear();
  rest.triangles.clear();
  for (std::size_t t = 0; t < subject.materials.size(); ++t)
    (wanted(subject.materials[t]) ? part : rest).triangles.push_back(subject.mesh.triangles[t]);
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud.points) points.emplace_back(truth_from_world * p.cast<double>());
  const std::vector<double> to_part = distances_to_surface(points, part), to_rest = distances_to_surface(points, rest);
  CloudFigures figures;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (to_part[i] > to_rest[i]) continue;
    ++figures.points;
    if (to_part[i] < 0.030) figures.right += 1.0;
  }
  figures.right /= static_cast<double>(std::max<std::size_t>(1, figures.points));
  const std::vector<Eigen::Vector3d> samples = sample_surface(part, 4000, 1);
  for (const double d : distances_to_cloud(samples, points)) figures.covered += d < 0.015 ? 1.0 / 4000 : 0.0;
  return figures;
}

Result<PointCloud> cloud_of(const RenderedBundle& rendered) {
  const auto made = run_stage(cloud_stage(), rendered, {{"long_side_px", 480}, {"neighbours", 4}});
  if (!made) return tl::unexpected<Error>(made.error());
  return read_cloud(rendered.bundle().work("cloud") / "cloud.ply");
}

// The whole subject is in the cloud, and nothing is invented beside it.
void expect_whole_cloud(const RenderedBundle& rendered, const Capture& capture, const CameraFigures& figures) {
  const auto cloud = cloud_of(rendered);
  ASSERT_TRUE(cloud) << cloud.error().message();
  const CloudFigures all = measure(*cloud, figures.truth_from_world, capture.subject, [](Material) { return true; });
  std::printf("cloud: %.3f covered, %.4f of %zu points right\n", all.covered, all.right, all.points);
  EXPECT_GT(all.covered, 0.9);
  EXPECT_GT(all.right, 0.99);
}

// A walk that must come out as a clean one does, in spite of its trouble.
void expect_as_without_trouble(const Capture& capture) {
  RenderedBundle rendered;
  rendered.add("body", capture);
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  expect_closed(figures);
  expect_whole_cloud(rendered, capture, figures);
}

TEST(Robust, without_trouble) {
  RenderedBundle rendered;
  rendered.add("body", make_capture(small_walk()));
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  expect_closed(figures);
  EXPECT_LT(figures.median_mm, 1.5 * clean_median_mm);
  EXPECT_LT(figures.largest_mm, 1.5 * clean_largest_mm);
}

TEST(Robust, a_third_of_the_frames_blurred) {
  Capture capture = make_capture(small_walk());
  for (std::size_t i = 1; i < capture.frames.size(); i += 3) {
    capture.frames[i].blurred = true;
    capture.frames[i].exposure_s = 0.25;  // of 1.0 s between keyframes: 3 degrees of the walk
  }
  expect_as_without_trouble(capture);
}

TEST(Robust, somebody_walks_through_the_background) {
  CaptureOptions options = small_walk();
  options.trouble.passer_by = true;
  expect_as_without_trouble(make_capture(options));
}

TEST(Robust, a_white_wall_on_half_of_the_circle) {
  CaptureOptions options = small_walk();
  options.trouble.white_half = true;
  expect_as_without_trouble(make_capture(options));
}

// What a mirror shows is as rigid as a room behind it would be: it must not move axis, floor or height.
TEST(Robust, a_mirrored_wardrobe) {
  CaptureOptions options = small_walk();
  options.trouble.mirror = true;
  expect_as_without_trouble(make_capture(options));
}

// Black clothes give the stereo nothing to hold on to: they may be missing, but nothing may be invented in their place,
// and what is not black must be there.
TEST(Robust, dark_clothes_leave_a_hole_and_nothing_else) {
  CaptureOptions options = small_walk();
  options.trouble.dark_clothes = true;
  const Capture capture = make_capture(options);
  RenderedBundle rendered;
  rendered.add("body", capture);
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  expect_closed(figures);

  const auto cloud = cloud_of(rendered);
  ASSERT_TRUE(cloud) << cloud.error().message();
  const auto dark = [](Material m) { return m == Material::sweater || m == Material::trousers; };
  const CloudFigures black = measure(*cloud, figures.truth_from_world, capture.subject, dark);
  const CloudFigures rest =
      measure(*cloud, figures.truth_from_world, capture.subject, [&](Material m) { return !dark(m); });
  std::printf("dark: %.2f covered, %.3f of %zu points right; rest: %.2f covered, %.3f of %zu points right\n",
              black.covered, black.right, black.points, rest.covered, rest.right, rest.points);
  EXPECT_GT(rest.covered, 0.9);
  EXPECT_GT(rest.right, 0.99);
  EXPECT_GT(black.right, 0.99);
  // What is missing is said, and why.
  const auto text = read_file(rendered.bundle().work("cloud") / "coverage.json");
  ASSERT_TRUE(text);
  const nlohmann::json holes = nlohmann::json::parse(*text).at("holes");
  const bool reported =
      std::any_of(holes.begin(), holes.end(), [](const nlohmann::json& hole) { return hole["kind"] == "not matched"; });
  EXPECT_TRUE(black.covered > 0.5 || reported) << holes.dump();
}

TEST(Robust, the_second_half_of_the_walk_first) {
  const Capture capture = make_capture(small_walk());
  const int count = capture.options.frames;
  std::vector<int> order;
  for (int i = 0; i < count; ++i) order.push_back((i + count / 2) % count);
  RenderedBundle rendered;
  rendered.add("body", capture, order);
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  expect_closed(figures);
}

TEST(Robust, the_two_videos_swapped) {
  CaptureOptions head = small_walk();
  head.sequence = synthetic::Sequence::orbit_head;
  head.frames = 36;
  head.fps = 36 / 40.0;
  RenderedBundle rendered;
  rendered.add("body", make_capture(head));
  rendered.add("head", make_capture(small_walk()));
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  expect_closed(figures);
}

TEST(Robust, a_walk_of_270_degrees_is_reported_as_open) {
  CaptureOptions options = small_walk();
  options.trouble.arc_deg = 270;
  options.frames = 48;
  RenderedBundle rendered;
  rendered.add("body", make_capture(options));
  double low = 0, high = 0;  // truly; the walk begins near azimuth 0
  for (const auto& [name, pose] : rendered.truth()) {
    const Eigen::Vector3d c = centre_of(pose);
    double azimuth = std::atan2(c.x(), c.z()) * 180 / M_PI;
    if (azimuth < -45) azimuth += 360;
    low = std::min(low, azimuth);
    high = std::max(high, azimuth);
  }
  ASSERT_NEAR(high - low, 270, 15);
  const CameraFigures figures = figures_of(rendered);
  expect_sound(figures);
  ASSERT_TRUE(figures.scene.contains("ring"));
  EXPECT_EQ(figures.scene["ring"], figures.result["ring"]);
  EXPECT_FALSE(figures.scene["ring"]["closed"]);
  EXPECT_NEAR(figures.scene["ring"]["covered_deg"], high - low, 2);
  EXPECT_NEAR(figures.scene["ring"]["largest_gap_deg"], 360 - (high - low), 2);
}

TEST(Robust, three_rooms_are_no_scene_and_the_operator_is_told_what_to_do) {
  RenderedBundle rendered;
  CaptureOptions options = small_walk();
  options.cell = 0.03;
  for (options.seed = 1; options.seed <= 3; ++options.seed)
    rendered.add("body", make_capture(options), {0, 1, 2, 3, 4, 5, 6, 7});
  const auto figures = place_cameras(rendered);
  ASSERT_FALSE(figures);
  std::puts(figures.error().message().c_str());
  EXPECT_EQ(figures.error().exit_code(), 1);
  EXPECT_NE(figures.error().what.find("fit together"), std::string::npos);
  EXPECT_FALSE(figures.error().remedy.empty());
}

}  // namespace
}  // namespace gyre
