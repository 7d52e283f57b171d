// SPDX-License-Identifier: Apache-2.0
#include "device/camera/camera_name.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(CameraName, ReadsKindsTargetsAndSettings) {
  const auto replay = parse_camera_name("replay:/a/what?.mp4?faults=/b.json");
  ASSERT_TRUE(replay);
  EXPECT_EQ(replay->kind, CameraName::Kind::replay);
  EXPECT_EQ(replay->target, "/a/what?.mp4");
  EXPECT_EQ(replay->faults, "/b.json");
  EXPECT_EQ(parse_camera_name("replay:/a/what?.mp4")->target, "/a/what?.mp4");

  const auto usb = parse_camera_name("v4l2:/dev/v4l/by-id/usb-x-video-index0?size=1280x720&format=YUYV&buffers=8");
  ASSERT_TRUE(usb);
  EXPECT_EQ(usb->kind, CameraName::Kind::v4l2);
  EXPECT_EQ(usb->target, "/dev/v4l/by-id/usb-x-video-index0");
  EXPECT_EQ(usb->width, 1280);
  EXPECT_EQ(usb->height, 720);
  EXPECT_EQ(usb->format, "YUYV");
  EXPECT_EQ(usb->buffers, 8);

  EXPECT_TRUE(parse_camera_name("libcamera:")->target.empty());
  EXPECT_EQ(parse_camera_name("libcamera:/base/soc/imx708@1a?buffers=2")->target, "/base/soc/imx708@1a");
}

TEST(CameraName, RefusesWhatNoCameraHas) {
  for (const char* const name :
       {"", "webcam", "replay:", "v4l2:", "v4l2:/dev/video0?buffers=0", "v4l2:/dev/video0?buffers=9",
        "v4l2:/dev/video0?size=0x10", "v4l2:/dev/video0?size=640", "v4l2:/dev/video0?format=H264",
        "libcamera:?format=NV12", "libcamera:?faults=x", "replay:/a?size=1x1",
        "replay:/a?faults=", "v4l2:/dev/video0?size=1x1?buffers=2"}) {
    const auto parsed = parse_camera_name(name);
    ASSERT_FALSE(parsed) << name;
    EXPECT_EQ(parsed.error().exit_code(), 2);
    EXPECT_FALSE(parsed.error().remedy.empty());
  }
}

}  // namespace
}  // namespace gyre
