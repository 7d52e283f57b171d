// SPDX-License-Identifier: Apache-2.0
#include "offload/report/texture_errors.h"
#include "common/render/rasterise.h"
#include "offload/report/held_out_views.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

// Two squares that share an edge of the surface and lie apart in the texture, each 6 texels wide.
TriangleMesh two_charts() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  mesh.uv = {{0.0, 0.0}, {0.375, 0.0}, {0.375, 0.375}, {0.0, 0.375},
             {0.5, 0.5}, {0.875, 0.5}, {0.875, 0.875}, {0.5, 0.875}};
  mesh.uv_triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  return mesh;
}

TEST(SeamEnergy, TellsStepsBetweenViewsFromThoseWithin) {
  cv::Mat albedo(16, 16, CV_8UC3), view(16, 16, CV_16U, cv::Scalar(0));
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      // 2 levels a texel along x; 10 more where the second view begins; nothing along y.
      const int level = 50 + 2 * x + (x >= 3 ? 10 : 0);
      albedo.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(level), 0, 0};
      if (x < 7 && y < 7) view.at<std::uint16_t>(y, x) = x >= 3 ? 2 : 1;
    }
  }
  const SeamEnergy energy = seam_energy(albedo, view, two_charts());
  EXPECT_NEAR(energy.border, 12.0, 1e-9);
  // Along x 5 of 6 steps are within a view, 2 levels each, in 7 rows; along y all 6 * 7 are, and none is a step.
  EXPECT_NEAR(energy.interior, 2.0 * 35 / (35 + 42), 1e-9);
  EXPECT_EQ(energy.charts, 0.0);  // nobody sees the second chart
}

TEST(SeamEnergy, ChartsAreComparedAtTheirCommonEdge) {
  cv::Mat albedo(16, 16, CV_8UC3, cv::Scalar(100, 100, 100)), view(16, 16, CV_16U, cv::Scalar(1));
  albedo(cv::Rect(7, 7, 9, 9)) = cv::Scalar(103, 104, 100);
  const SeamEnergy energy = seam_energy(albedo, view, two_charts());
  EXPECT_NEAR(energy.charts, 5.0, 1e-4);
}

TEST(PictureSimilarity, KnownNoiseGivesItsSignalToNoiseRatio) {
  cv::Mat a(64, 64, CV_8UC3), mask(64, 64, CV_8U, cv::Scalar(255));
  cv::RNG random(3);
  random.fill(a, cv::RNG::UNIFORM, 40, 200);
  cv::GaussianBlur(a, a, {0, 0}, 1.0);
  EXPECT_NEAR(picture_similarity(a, a, mask).ssim, 1.0, 1e-6);
  const cv::Mat brighter = a + cv::Scalar::all(10);
  EXPECT_NEAR(picture_similarity(a, brighter, mask).psnr, 20 * std::log10(25.5), 1e-6);
  cv::Mat blurred;
  cv::GaussianBlur(a, blurred, {0, 0}, 3.0);
  EXPECT_LT(picture_similarity(a, blurred, mask).ssim, 0.7);
  EXPECT_LT(sharpness(blurred, mask), 0.3 * sharpness(a, mask));
  EXPECT_EQ(sharpness(a, cv::Mat::zeros(64, 64, CV_8U)), 0.0);
}

// A picture every frame of which shows the mesh as it is, in a world that is half as large as the true one.
TEST(HeldOut, AnExactFitPredictsTheFramesThatWereNotUsed) {
  const TemporaryFolder folder;
  TruthPass pass;
  pass.camera = Camera::from_fov(64, 96, 0.8);
  pass.surface = two_charts();
  pass.video = folder.path();
  const cv::Mat albedo(16, 16, CV_8UC3, cv::Scalar(60, 120, 180));
  for (int i = 0; i < 24; ++i) {
    pass.cam_from_world[i] = look_at({1.0 + 0.02 * i, 0.5, 3.0}, {1.0, 0.5, 0.0});
    cv::imwrite((folder.path() / (std::to_string(100 + i) + ".png")).string(),
                render(pass.surface, albedo, pass.camera, pass.cam_from_world[i], {.lit = false}));
  }
  TriangleMesh fitted = pass.surface;
  for (Eigen::Vector3d& v : fitted.vertices) v *= 0.5;
  const Similarity truth_from_bundle{2.0, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  const std::vector<FrameId> keyframes = {{"body", 3}};
  const auto figures = held_out_figures({{"body", pass}}, keyframes, truth_from_bundle, fitted, albedo);
  ASSERT_TRUE(figures) << figures.error().message();
  EXPECT_GE(figures->at("views"), 1);
  EXPECT_LT(figures->at("cielab_rmse").get<double>(), 0.1);
  EXPECT_GT(figures->at("ssim").get<double>(), 0.99);

  for (int i = 0; i < 24; ++i) pass.unsharp.insert(i);
  EXPECT_FALSE(held_out_figures({{"body", pass}}, keyframes, truth_from_bundle, fitted, albedo));
}

}  // namespace
}  // namespace gyre
