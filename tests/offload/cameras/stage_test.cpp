// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/cameras_stage.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

// A bundle of pictures in the test's temporary folder, removed at the end.
class StageTest : public testing::Test {
 protected:
  void SetUp() override {
    Scan scan;
    scan.id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
    scan.passes.push_back({"body", 0.0, 10, 200, 300});
    bundle_ = *create_bundle(root_, scan);
    std::filesystem::create_directories(root_ / "out");
  }

  void add(int index, const cv::Mat& picture) const { cv::imwrite(bundle_.frame("body", index).string(), picture); }

  // The error of the stage in one line.
  std::string error() const {
    const Stage stage = cameras_stage();
    StageContext context{.bundle = bundle_, .out = root_ / "out", .options = stage.options, .threads = 1};
    const auto result = stage.run(context);
    return result ? "none" : result.error().message();
  }

  static cv::Mat noise(int seed, int width = 200, int height = 300) {
    cv::Mat picture(height, width, CV_8UC3);
    cv::RNG random(static_cast<std::uint64_t>(seed));
    random.fill(picture, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(picture, picture, {}, 1.5);
    cv::normalize(picture, picture, 0, 255, cv::NORM_MINMAX);
    return picture;
  }

  TemporaryFolder folder_;
  const std::filesystem::path& root_ = folder_.path();
  Bundle bundle_{""};
};

TEST_F(StageTest, too_few_pictures) {
  add(0, noise(1));
  add(1, noise(2));
  EXPECT_NE(error().find("too few pictures (2)"), std::string::npos) << error();
}

TEST_F(StageTest, pictures_of_mixed_size) {
  add(0, noise(1));
  add(1, noise(2));
  add(2, noise(3, 300, 200));
  EXPECT_NE(error().find("differ in size: body-000002.jpg"), std::string::npos) << error();
}

TEST_F(StageTest, no_texture) {
  for (int i = 0; i < 4; ++i) add(i, cv::Mat(300, 200, CV_8UC3, cv::Scalar(200, 200, 200)));
  EXPECT_NE(error().find("no texture"), std::string::npos) << error();
}

TEST_F(StageTest, pictures_of_different_things) {
  for (int i = 0; i < 4; ++i) add(i, noise(i + 1));
  EXPECT_NE(error().find("do not fit together"), std::string::npos) << error();
}

TEST_F(StageTest, a_damaged_picture_is_named) {
  for (int i = 0; i < 3; ++i) add(i, noise(i + 1));
  std::ofstream(bundle_.frame("body", 1)) << "not a picture";
  EXPECT_NE(error().find("cannot read picture"), std::string::npos) << error();
  EXPECT_NE(error().find("body-000001.jpg"), std::string::npos) << error();
}

TEST_F(StageTest, a_negative_length_is_wrong_use) {
  for (int i = 0; i < 3; ++i) add(i, noise(i + 1));
  const Stage stage = cameras_stage();
  for (const char* length : {"height_mm", "turntable_radius_mm"}) {
    StageContext context{.bundle = bundle_, .out = root_ / "out", .options = {{length, -5.0}}, .threads = 1};
    const auto result = stage.run(context);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().exit_code(), 2);
    EXPECT_NE(result.error().message().find(length), std::string::npos);
  }
}

}  // namespace
}  // namespace gyre
