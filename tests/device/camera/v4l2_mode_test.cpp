// SPDX-License-Identifier: Apache-2.0
#include "device/camera/v4l2_device.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr std::uint32_t mjpeg = V4L2_PIX_FMT_MJPEG;
constexpr std::uint32_t yuyv = V4L2_PIX_FMT_YUYV;
constexpr std::uint32_t nv12 = V4L2_PIX_FMT_NV12;

// As a usual USB camera has them.
const std::vector<V4l2Mode> usb = {{yuyv, 640, 480, 30.0},   {yuyv, 1920, 1080, 5.0},   {mjpeg, 640, 480, 60.0},
                                   {mjpeg, 1280, 720, 30.0}, {mjpeg, 1920, 1080, 30.0}, {mjpeg, 3840, 2160, 30.0}};

TEST(V4l2Mode, TheLargestThatIsFastEnoughUpTo1080pInTheCamerasOwnJpeg) {
  EXPECT_EQ(choose_mode(usb, 0, 0, 0), (V4l2Mode{mjpeg, 1920, 1080, 30.0}));
  EXPECT_EQ(choose_mode(usb, yuyv, 0, 0), (V4l2Mode{yuyv, 640, 480, 30.0}));
}

TEST(V4l2Mode, AWantedSizeIsTakenAtAnyRate) {
  EXPECT_EQ(choose_mode(usb, 0, 3840, 2160), (V4l2Mode{mjpeg, 3840, 2160, 30.0}));
  EXPECT_EQ(choose_mode(usb, 0, 1300, 700), (V4l2Mode{mjpeg, 1280, 720, 30.0}));
  EXPECT_EQ(choose_mode(usb, yuyv, 1920, 1080), (V4l2Mode{yuyv, 1920, 1080, 5.0}));
}

TEST(V4l2Mode, SlowOrSilentCamerasGiveWhatTheyHave) {
  EXPECT_EQ(choose_mode(std::vector<V4l2Mode>{{nv12, 640, 480, 5.0}, {nv12, 320, 240, 10.0}}, 0, 0, 0)->width, 320);
  EXPECT_EQ(choose_mode(std::vector<V4l2Mode>{{nv12, 640, 480, 0.0}, {yuyv, 320, 240, 30.0}}, 0, 0, 0)->width, 640);
  EXPECT_EQ(choose_mode(std::vector<V4l2Mode>{{nv12, 4056, 3040, 30.0}, {nv12, 3840, 2160, 30.0}}, 0, 0, 0)->width,
            3840);
}

TEST(V4l2Mode, NothingWithoutTheFormat) {
  EXPECT_FALSE(choose_mode({}, 0, 0, 0));
  EXPECT_FALSE(choose_mode(usb, nv12, 0, 0));
}

TEST(V4l2Device, SaysWhyItCannotBeOpened) {
  EXPECT_NE(V4l2Device::open("/dev/no-such-video").error().message().find("no camera there"), std::string::npos);
  EXPECT_NE(V4l2Device::open("/dev/null").error().message().find("not a camera"), std::string::npos);
}

}  // namespace
}  // namespace gyre
