// SPDX-License-Identifier: Apache-2.0
#include "offload/report/statistics.h"
#include "offload/report/surface_errors.h"
#include "offload/report/truth.h"
#include "offload/report/view_errors.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

// A unit square in the plane z = `z`, facing +Z.
TriangleMesh square(double z) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(statistics, quantiles_interpolate_between_neighbours) {
  EXPECT_EQ(quantile({}, 0.5), 0);
  EXPECT_DOUBLE_EQ(quantile({3, 1, 2}, 0.5), 2);
  EXPECT_DOUBLE_EQ(quantile({4, 1, 2, 3}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.95), 9.5);
  const std::vector<double> values = {0.001, 0.002, 0.009};
  const nlohmann::json s = summary(values, 1000);
  EXPECT_DOUBLE_EQ(s["mean"], 4);
  EXPECT_DOUBLE_EQ(s["max"], 9);
  EXPECT_DOUBLE_EQ(share_within(values, 0.005), 2.0 / 3);
  EXPECT_TRUE(summary({})["mean"].is_null());
}

// Reference values of the sRGB primaries in CIELAB for D65 (Lindbloom).
TEST(lab, known_colours) {
  const auto expect = [](int r, int g, int b, double l, double a, double bb) {
    const Eigen::Vector3d lab =
        lab_from_srgb(static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b));
    EXPECT_NEAR(lab[0], l, 0.02);
    EXPECT_NEAR(lab[1], a, 0.02);
    EXPECT_NEAR(lab[2], bb, 0.02);
  };
  expect(0, 0, 0, 0, 0, 0);
  expect(255, 255, 255, 100, 0, 0);
  expect(119, 119, 119, 50.03, 0, 0);
  expect(255, 0, 0, 53.24, 80.09, 67.20);
  expect(0, 255, 0, 87.74, -86.18, 83.18);
  expect(0, 0, 255, 32.30, 79.19, -107.86);
}

TEST(colour_error, counts_only_where_both_masks_are_set) {
  const cv::Mat grey(2, 2, CV_8UC3, cv::Scalar::all(119)), white(2, 2, CV_8UC3, cv::Scalar::all(255));
  const cv::Mat all(2, 2, CV_8U, cv::Scalar(255));
  cv::Mat left = all.clone();
  left.col(1) = 0;
  EXPECT_EQ(colour_error(grey, grey, all, all).rmse(), 0);
  const ColourError error = colour_error(grey, white, left, all);
  EXPECT_EQ(error.pixels, 2);
  EXPECT_NEAR(error.rmse(), 49.97, 0.02);
  EXPECT_EQ(colour_error(grey, white, left, cv::Mat(2, 2, CV_8U, cv::Scalar(0))).rmse(), 0);
}

TEST(surface_errors, samples_cover_the_area_evenly) {
  TriangleMesh mesh = square(0);
  mesh.vertices[2] = mesh.vertices[1];  // the first triangle has no area: nothing may fall on it
  mesh.triangles[1] = {0, 1, 3};
  for (const Eigen::Vector3d& p : sample_surface(mesh, 200, 1)) EXPECT_LE(p.x() + p.y(), 1 + 1e-12);
  int upper = 0;
  for (const Eigen::Vector3d& p : sample_surface(square(0), 1000, 1)) upper += p.y() > p.x();
  EXPECT_NEAR(upper, 500, 1);
  EXPECT_TRUE(sample_surface({}, 10, 1).empty());
}

TEST(surface_errors, distances_to_surfaces_and_clouds) {
  const std::vector<Eigen::Vector3d> points = {{0.5, 0.5, 0.3}, {2, 0.5, 0}};
  const auto to_surface = distances_to_surface(points, square(0));
  EXPECT_NEAR(to_surface[0], 0.3, 1e-9);
  EXPECT_NEAR(to_surface[1], 1.0, 1e-9);
  const std::vector<Eigen::Vector3d> cloud = {{0.5, 0.5, 0}, {3, 0.5, 0}, {9, 9, 9}};
  const auto to_cloud = distances_to_cloud(points, cloud);
  EXPECT_NEAR(to_cloud[0], 0.3, 1e-9);
  EXPECT_NEAR(to_cloud[1], 1.0, 1e-9);
}

TEST(surface_errors, hidden_vertices_are_not_visible) {
  TriangleMesh two = square(0);
  const TriangleMesh behind = square(-0.5);
  for (const Eigen::Vector3d& v : behind.vertices)
    two.vertices.push_back(Eigen::Vector3d(0.25, 0.25, 0) + v.cwiseProduct(Eigen::Vector3d(0.5, 0.5, 1)));
  for (const Eigen::Vector3i& t : behind.triangles) two.triangles.push_back(t + Eigen::Vector3i::Constant(4));
  // From the front at z = 3, looking along -Z: x right, y down, z forward.
  Pose front;
  front.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  front.translation = -(front.rotation * Eigen::Vector3d(0.5, 0.5, 3));
  const Camera wide = Camera::from_fov(200, 200, 1.0), narrow = Camera::from_fov(200, 200, 0.1);
  const std::pair<Camera, Pose> see[] = {{wide, front}};
  EXPECT_EQ(visible_vertices(two, see), (std::vector<int>{0, 1, 2, 3}));
  const std::pair<Camera, Pose> see_nothing[] = {{narrow, front}};
  EXPECT_TRUE(visible_vertices(two, see_nothing).empty());
}

TEST(truth, mixamo_joints_have_vrm_names) {
  EXPECT_EQ(vrm_joint_name("Spine2"), "upperChest");
  EXPECT_EQ(vrm_joint_name("LeftForeArm"), "leftLowerArm");
  EXPECT_EQ(vrm_joint_name("RightToeBase"), "rightToes");
  EXPECT_EQ(vrm_joint_name("HeadEnd"), "");
  EXPECT_EQ(vrm_joint_name("LeftWing"), "");
}

}  // namespace
}  // namespace gyre
