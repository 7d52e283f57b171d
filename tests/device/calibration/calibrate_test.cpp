// SPDX-License-Identifier: Apache-2.0
// gyre-device calibrate on rendered pictures of the board.
#include "common/bundle/atomic_file.h"
#include "device/calibration/calibration_file.h"
#include "tests/device/calibration/lens_picture.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

const Camera lens{.width = 640, .height = 480, .fx = 550, .fy = 550, .cx = 322.5, .cy = 236.4, .k1 = -0.1};

class Calibrate : public testing::Test {
 protected:
  // Pictures of the board, `count` of them.
  std::string pictures(int count) {
    const std::filesystem::path place = folder_.path() / ("pictures-" + std::to_string(count));
    std::filesystem::create_directories(place);
    int index = 0;
    for (const Pose& pose : round_of_views(lens, count, 0.75)) {
      cv::imwrite((place / ("board-" + std::to_string(++index) + ".png")).string(), picture_through_lens(lens, pose));
    }
    return place.string();
  }

  Finished calibrate(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--log-level", "error", "calibrate", "--cameras", cameras_.string()});
    return run_program("gyre-device", arguments);
  }

  TemporaryFolder folder_;
  const std::filesystem::path cameras_ = folder_.path() / "cameras";
};

TEST_F(Calibrate, KeepsWhatItFindsForTheCamerasScans) {
  const Finished f = calibrate({"--pictures", pictures(18), "--camera", "libcamera:"});
  ASSERT_EQ(f.code, 0) << f.err;
  const nlohmann::json line = nlohmann::json::parse(last_line(f.out));
  EXPECT_LT(line.at("reprojection_error_px"), 0.3);
  EXPECT_TRUE(std::filesystem::exists(line.at("kept").get<std::string>()));
  const std::optional<Camera> kept = read_calibration(cameras_, "libcamera:").value();
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->fx / lens.fx, 1.0, 0.01);
}

TEST_F(Calibrate, SaysWhatToDoAboutABadOne) {
  const Finished f = calibrate({"--pictures", pictures(4), "--camera", "libcamera:"});
  EXPECT_EQ(f.code, 1);
  EXPECT_NE(f.err.find("4 of at least 12"), std::string::npos) << f.err;
  EXPECT_FALSE(std::filesystem::exists(cameras_));
  EXPECT_EQ(calibrate({}).code, 2);
  EXPECT_EQ(calibrate({"--pictures", pictures(4), "--camera", "a camera"}).code, 2);
}

}  // namespace
}  // namespace gyre
