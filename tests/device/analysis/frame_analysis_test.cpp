// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/frame_analysis.h"
#include "tests/device/moving_scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(FrameAnalysis, BlurIsTheWayWhileTheShutterIsOpen) {
  test::MovingScene scene(10, 3);
  FrameAnalysis analysis(scene.info());
  FrameReading reading;
  for (int i = 0; i < 10; ++i) {
    const Frame frame = *scene.next(std::chrono::seconds(1))->frame;
    reading = analysis.add(frame, 1.0 / 45.0);  // a third of the time between frames
  }
  EXPECT_NEAR(reading.measure.motion, 3.0, 0.3);
  EXPECT_NEAR(reading.blur_px, 1.0, 0.1);
  EXPECT_TRUE(reading.exposure_known);
  EXPECT_NEAR(reading.motion, 3.0 * 15.0 / 96.0, 0.05) << "widths a second";
}

TEST(FrameAnalysis, SharesOfBlackAndWhite) {
  const CameraInfo info{.name = "test", .width = 100, .height = 80, .fps = 10.0};
  cv::Mat image(80, 100, CV_8UC3, cv::Scalar::all(128));
  image.rowRange(0, 8).setTo(cv::Scalar::all(3));
  image.rowRange(60, 80).setTo(cv::Scalar::all(255));
  const FrameReading reading = FrameAnalysis(info).add({.index = 0, .time = 0.0, .image = image, .jpeg = {}});
  EXPECT_NEAR(reading.underexposed, 0.1, 1e-9);
  EXPECT_NEAR(reading.overexposed, 0.25, 1e-9);
  EXPECT_NEAR(reading.brightness, (0.1 * 3 + 0.25 * 255 + 0.65 * 128) / 255.0, 1e-6);
}

TEST(FrameAnalysis, TheLensFollowsExif) {
  CameraInfo info{.name = "test", .width = 1280, .height = 720, .fps = 10.0};
  info.focal_35mm = 36.0;
  EXPECT_NEAR(lens_of(info).fx, 1280.0, 1e-6) << "36 mm of film see the whole width";
}

}  // namespace
}  // namespace gyre
