// SPDX-License-Identifier: Apache-2.0
#include "offload/report/overlays.h"

#include "common/bundle/bundle.h"
#include "common/render/rasterise.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

// Twelve cameras on a ring of pass "body", and one of pass "head".
ColmapModel ring() {
  ColmapModel model;
  model.cameras[1] = Camera::from_fov(90, 160, 0.9);
  for (int i = 0; i < 13; ++i) {
    const double azimuth = i * std::numbers::pi / 6;
    ModelImage image;
    image.camera_id = 1;
    image.name = frame_name(i < 12 ? "body" : "head", i);
    image.cam_from_world = look_at({2 * std::sin(azimuth), 0.5, 2 * std::cos(azimuth)}, {0, 0.5, 0});
    model.images[i + 1] = image;
  }
  return model;
}

TEST(SpreadViews, TakesTheFourSidesOfWhereTheSubjectLooks) {
  const ColmapModel model = ring();
  const auto views = spread_views(model, "body", std::numbers::pi / 2 + 0.1, 4);
  ASSERT_EQ(views.size(), 4U);
  const std::array<int, 4> wanted = {3, 6, 9, 0};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(views[i]->name, frame_name("body", wanted[i]));
}

TEST(SpreadViews, TakesNoViewTwice) {
  EXPECT_EQ(spread_views(ring(), "head", 0, 4).size(), 1U);
  EXPECT_TRUE(spread_views(ring(), "turn", 0, 4).empty());
}

TEST(MakeOverlay, DrawsTheMeshWhereTheCameraSeesIt) {
  const TemporaryFolder folder;
  const ColmapModel model = ring();
  const std::filesystem::path photo = folder.path() / "photo.png";
  cv::imwrite(photo.string(), cv::Mat(160, 90, CV_8UC3, cv::Scalar(200, 10, 10)));
  TriangleMesh square;  // facing the first camera, in the middle of its picture
  square.vertices = {{-0.2, 0.3, 0}, {0.2, 0.3, 0}, {0.2, 0.7, 0}, {-0.2, 0.7, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  square.uv = {{0, 0}};
  square.uv_triangles = {{0, 0, 0}, {0, 0, 0}};
  const cv::Mat green(4, 4, CV_8UC3, cv::Scalar(0, 255, 0));
  const Overlay overlay = make_overlay(model, model.images.at(1), photo, square, green, 80);
  ASSERT_EQ(overlay.photo.size(), cv::Size(45, 80));
  ASSERT_EQ(overlay.avatar.size(), overlay.photo.size());
  EXPECT_EQ(overlay.avatar.at<cv::Vec3b>(40, 22), cv::Vec3b(0, 255, 0));
  EXPECT_EQ(overlay.photo.at<cv::Vec3b>(40, 22), cv::Vec3b(200, 10, 10));
  EXPECT_EQ(overlay.avatar.at<cv::Vec3b>(2, 2), cv::Vec3b(200, 10, 10));
}

TEST(MakeOverlay, IsEmptyWithoutAPhotograph) {
  const ColmapModel model = ring();
  EXPECT_TRUE(make_overlay(model, model.images.at(1), "/nowhere.jpg", {}, {}, 80).avatar.empty());
}

TEST(HeatColours, RunFromLightToDarkAndSayWhereNothingIsKnown) {
  const auto colours = heat_colours({0, 2.5, 5, 7.5, 10, 99, std::numeric_limits<double>::infinity()}, 10);
  const auto brightness = [&](std::size_t i) { return colours[i][0] + colours[i][1] + colours[i][2]; };
  for (std::size_t i = 1; i < 5; ++i) EXPECT_LT(brightness(i), brightness(i - 1));
  EXPECT_EQ(colours[5], colours[4]);
  EXPECT_EQ(colours[6], (Rgb{150, 155, 165}));
}

}  // namespace
}  // namespace gyre
