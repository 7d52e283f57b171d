// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/calibration_file.h"

#include "common/bundle/atomic_file.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const Calibration calibration = {
    .camera = {.width = 1280, .height = 720, .fx = 900, .fy = 900, .cx = 641, .cy = 359, .k1 = -0.1}, .views = 14};

TEST(CalibrationFile, KeepsTheLensOfACamera) {
  const TemporaryFolder folder;
  const std::filesystem::path place = folder.path() / "cameras";
  const std::string camera = "v4l2:/dev/v4l/by-id/usb-Maker_Camera-index0";
  EXPECT_FALSE(read_calibration(place, camera).value());
  ASSERT_TRUE(write_calibration(place, camera + "?size=1280x720", calibration));
  const std::optional<Camera> kept = read_calibration(place, camera + "?format=YUYV").value();
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->fx, 900);
  EXPECT_EQ(kept->k1, -0.1);
  EXPECT_FALSE(read_calibration(place, "libcamera:").value());
  // Another one whose name has the same letters.
  EXPECT_FALSE(read_calibration(place, "v4l2:/dev/v4l_by-id_usb-Maker_Camera-index0").value());
}

TEST(CalibrationFile, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_FALSE(write_calibration(folder.path(), "a camera", calibration));
  ASSERT_TRUE(write_file(calibration_file(folder.path(), "libcamera:").value(), "{\"model\": 3"));
  const auto read = read_calibration(folder.path(), "libcamera:");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message().find("calibrate"), std::string::npos);
  EXPECT_LE(calibration_file(folder.path(), "replay:/" + std::string(3000, 'x')).value().filename().string().size(),
            255u);
}

}  // namespace
}  // namespace gyre
