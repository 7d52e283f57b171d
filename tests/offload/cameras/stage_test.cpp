// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/cameras_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "tests/offload/cameras/column_scene.h"
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

  // Runs the stage on a capture of the column, and checks its poses against the ring they are on.
  void expect_column(const Column& column, const std::string& motion) const {
    const Stage stage = cameras_stage();
    StageContext context{.bundle = bundle_, .out = root_ / "out", .options = stage.options, .threads = 1};
    const auto result = stage.run(context);
    ASSERT_TRUE(result) << result.error().message();
    EXPECT_EQ(result->at("motion"), motion);
    EXPECT_EQ(result->at("registered"), column.scene.views.size());
    const auto scene = read_file(context.out / "scene.json");
    ASSERT_TRUE(scene);
    EXPECT_EQ(nlohmann::json::parse(*scene).at("motion"), motion);
    const auto model = read_colmap_model(context.out);
    ASSERT_TRUE(model);
    std::vector<Eigen::Vector3d> truth, found;
    for (const auto& [id, image] : model->images) {
      truth.push_back(centre_of(column.scene.views[static_cast<std::size_t>(id - 1)].cam_from_world));
      found.push_back(centre_of(image.cam_from_world));
    }
    const auto truth_from_found = align_points(truth, found);
    ASSERT_TRUE(truth_from_found);
    for (std::size_t i = 0; i < truth.size(); ++i)
      EXPECT_LT((*truth_from_found * found[i] - truth[i]).norm(), 0.02) << "metres, of view " << i;
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

TEST_F(StageTest, a_walk_around_is_an_orbit) {
  const Column column = make_column(24);
  for (int v = 0; v < 24; ++v) add(v, column.picture(v));
  expect_column(column, "orbit");
}

TEST_F(StageTest, a_fixed_camera_before_what_turns_is_a_turn) {
  const Column column = make_column(36);
  for (int v = 0; v < 36; ++v) add(v, column.turned_picture(v));
  expect_column(column, "turn");
}

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
