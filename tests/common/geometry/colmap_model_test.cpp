// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/colmap_model.h"

#include <gtest/gtest.h>
#include <clocale>
#include <fstream>

namespace gyre {
namespace {

class ColmapModelTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) /
        ("colmap-" + std::to_string(::getpid()) + "-" + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

ColmapModel small_model() {
  ColmapModel model;
  model.cameras[1] = {.width = 720,
                      .height = 1280,
                      .fx = 1152.3,
                      .fy = 1150.8,
                      .cx = 358.7,
                      .cy = 643.2,
                      .k1 = -0.05,
                      .k2 = 0.01,
                      .k3 = 0.1};
  ModelImage image;
  image.name = "body-000004.jpg";
  image.cam_from_world = {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())), {1.0 / 3, 2, 3}};
  image.observations = {{{10.25, 20.5}, 7}, {{1, 2}, -1}};
  model.images[3] = image;
  model.images[4] = image;
  model.images[4].observations.clear();
  model.points[7] = {.position = {1, 2, 1e-7}, .rgb = {1, 2, 255}, .error = 0.5, .track = {{3, 0}}};
  return model;
}

TEST_F(ColmapModelTest, RoundTripIsExact) {
  const ColmapModel model = small_model();
  ASSERT_TRUE(write_colmap_model(model, folder_));
  const Result<ColmapModel> read = read_colmap_model(folder_);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->cameras.at(1).k3, 0.1);
  EXPECT_EQ(read->images.at(3).cam_from_world.translation, model.images.at(3).cam_from_world.translation);
  EXPECT_EQ(read->images.at(3).observations.at(0).pixel, Eigen::Vector2d(10.25, 20.5));
  EXPECT_TRUE(read->images.at(4).observations.empty());
  EXPECT_EQ(read->images.at(4).name, "body-000004.jpg");
  EXPECT_EQ(read->points.at(7).track, model.points.at(7).track);
  EXPECT_EQ(read->points.at(7).position, model.points.at(7).position);
}

TEST_F(ColmapModelTest, DamagedLinesAreNamed) {
  ASSERT_TRUE(write_colmap_model(small_model(), folder_));
  std::ofstream(folder_ / "cameras.txt") << "1 PINHOLE 720 nonsense\n";
  const Result<ColmapModel> read = read_colmap_model(folder_);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message().find("cameras.txt:1"), std::string::npos);
}

TEST_F(ColmapModelTest, UnknownCameraTypeIsNamed) {
  ASSERT_TRUE(write_colmap_model(small_model(), folder_));
  std::ofstream(folder_ / "cameras.txt") << "1 FOV 720 1280 1 2 3 4 5\n";
  const Result<ColmapModel> read = read_colmap_model(folder_);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message().find("FOV"), std::string::npos);
}

TEST_F(ColmapModelTest, MissingFolderIsAnError) {
  EXPECT_FALSE(read_colmap_model(folder_ / "nothing"));
}

TEST(ColmapModel, ImagesWithoutPointsCanBeLeftOut) {
  ColmapModel model = small_model();  // image 4 has no observations
  ModelImage blurred = model.images[3];
  for (auto& o : blurred.observations) o.point_id = -1;
  model.images[5] = blurred;
  EXPECT_EQ(model.remove_images_without_points(), 2);
  ASSERT_EQ(model.images.size(), 1U);
  EXPECT_TRUE(model.images.contains(3));

  model.images[3] = blurred;
  EXPECT_EQ(model.remove_images_without_points(), 0);
  EXPECT_EQ(model.images.size(), 1U);
}

}  // namespace
}  // namespace gyre
