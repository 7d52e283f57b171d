// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/sharpness.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

using test::RayScene;

constexpr int count = 36;  // a closed ring, ten degrees apart

cv::Mat moved(const cv::Mat& picture) {  // along the row, as of a camera that turns while it exposes
  cv::Mat blurred;
  cv::blur(picture, blurred, cv::Size(7, 1));
  return blurred;
}

cv::Mat out_of_focus(const cv::Mat& picture) {
  cv::Mat blurred;
  cv::GaussianBlur(picture, blurred, cv::Size(), 2.0);
  return blurred;
}

std::vector<StereoView> ring(const RayScene& scene, const std::function<cv::Mat(int, const cv::Mat&)>& lens) {
  const Camera camera = test::test_camera(96);
  const std::vector<Pose> poses = test::arc(scene, count, 360.0 / count);
  std::vector<StereoView> views;
  for (int i = 0; i < count; ++i) {
    const cv::Mat picture = lens(i, scene.picture(camera, poses[i]));
    views.push_back(make_stereo_view("view", picture, camera, poses[i], camera.height, 2));
  }
  return views;
}

TEST(Sharpness, BlurOfBothKindsIsSeen) {
  const RayScene scene;
  const std::vector<StereoView> views = ring(scene, [](int i, const cv::Mat& picture) {
    return i % 6 == 0 ? moved(picture) : i % 6 == 3 ? out_of_focus(picture) : picture;
  });
  const std::vector<double> sharpness = relative_sharpness(views, scene.region(), 1);
  for (int i = 0; i < count; ++i) {
    if (i % 3 == 0) {
      EXPECT_LT(sharpness[i], 0.75) << i;
    } else {
      EXPECT_GT(sharpness[i], 0.85) << i;
    }
  }
  EXPECT_EQ(relative_sharpness(views, scene.region(), 3), sharpness);
}

TEST(Sharpness, BlurredViewsThatOthersMakeUpForAreLeftOut) {
  const RayScene scene;
  std::vector<double> sharpness(count, 1.0);
  for (int i = 0; i < count; i += 3) sharpness[i] = 0.4;
  const std::vector<StereoView> views = ring(scene, [](int, const cv::Mat& picture) { return picture; });
  const std::vector<char> use = views_to_use(views, scene.region(), sharpness, {});
  for (int i = 0; i < count; ++i) EXPECT_EQ(use[i], i % 3 == 0 ? 0 : 1) << i;
}

TEST(Sharpness, WhereNothingElseLooksBlurredViewsStay) {
  const RayScene scene;
  std::vector<double> sharpness(count, 1.0);
  for (int i = 10; i < 20; ++i) sharpness[i] = 0.4;
  const std::vector<StereoView> views = ring(scene, [](int, const cv::Mat& picture) { return picture; });
  const std::vector<char> use = views_to_use(views, scene.region(), sharpness, {});
  for (int i = 13; i < 17; ++i) EXPECT_EQ(use[i], 1) << i;
  for (int i = 20; i < count; ++i) EXPECT_EQ(use[i], 1) << i;
}

}  // namespace
}  // namespace gyre
