// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "ray_scene.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

using nlohmann::json;

// A bundle with keyframes and cameras of the test scene.
class CloudStage : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(root_ / "frames");
    std::filesystem::create_directories(root_ / "out");
  }

  void write_cameras(int views, int width = 112) {
    const std::filesystem::path cameras = root_ / "work" / "cameras";
    std::filesystem::create_directories(cameras);
    ColmapModel model;
    model.cameras[1] = test::test_camera(width);
    model.cameras[1].k1 = -0.05;
    int id = 0;
    for (const Pose& pose : test::arc(scene_, views, 9.0)) {
      ModelImage image;
      image.name = frame_name("body", 10 * id);
      image.cam_from_world = pose;
      cv::imwrite(root_ / "frames" / image.name, scene_.picture(model.cameras[1], pose));
      model.images[++id] = image;
    }
    ASSERT_TRUE(write_colmap_model(model, cameras));
    const SubjectRegion box = scene_.region();
    const json scene = {
        {"box", {{"min", {box.min.x(), box.min.y(), box.min.z()}}, {"max", {box.max.x(), box.max.y(), box.max.z()}}}}};
    ASSERT_TRUE(write_file(cameras / "scene.json", scene.dump()));
  }

  Result<json> run(const json& changes = json::object(), double memory_gib = 4.0) const {
    const Stage stage = cloud_stage();
    StageContext ctx{Bundle(root_), root_ / "out", stage.options};
    ctx.options.update(changes);
    ctx.memory_gib = memory_gib;
    return stage.run(ctx);
  }

  test::RayScene scene_;
  TemporaryFolder folder_;
  const std::filesystem::path& root_ = folder_.path();
};

TEST_F(CloudStage, WritesCloudAndFacts) {
  write_cameras(5);
  const auto facts = run({{"spacing_mm", 5.0}});
  ASSERT_TRUE(facts) << facts.error().message();
  const auto cloud = read_cloud(root_ / "out" / "cloud.ply");
  ASSERT_TRUE(cloud) << cloud.error().message();
  EXPECT_EQ(facts->at("points").get<std::size_t>(), cloud->points.size());
  EXPECT_EQ(cloud->normals.size(), cloud->points.size());
  EXPECT_EQ(cloud->colours.size(), cloud->points.size());
  EXPECT_EQ(cloud->confidence.size(), cloud->points.size());
  EXPECT_EQ(cloud->deviation.size(), cloud->points.size());
  EXPECT_EQ(cloud->views.size(), cloud->points.size());
  EXPECT_GT(cloud->points.size(), 1500U);
  const auto coverage = read_file(root_ / "out" / "coverage.json");
  ASSERT_TRUE(coverage);
  EXPECT_EQ(json::parse(*coverage).at("holes").size(), facts->at("coverage").at("holes").get<std::size_t>());
  const auto text = read_file(root_ / "out" / "cloud.json");
  ASSERT_TRUE(text);
  EXPECT_EQ(json::parse(*text), *facts);
  EXPECT_NEAR(facts->at("height_m").get<double>(), scene_.centre.y() + scene_.radius, 0.02);
}

// Where the top of the subject is in the cloud, its height against the stature it was given says how lengths are wrong.
TEST_F(CloudStage, TheScaleIsCorrectedWhereItRestsOnTheStature) {
  write_cameras(5);
  const std::filesystem::path file = root_ / "work" / "cameras" / "scene.json";
  json scene = json::parse(*read_file(file));
  const double height = scene_.centre.y() + scene_.radius;
  scene["height_mm"] = 1020 * height;
  for (const char* source : {"height", "board"}) {
    scene["scale_source"] = source;
    ASSERT_TRUE(write_file(file, scene.dump()));
    const auto facts = run({{"spacing_mm", 5.0}});
    ASSERT_TRUE(facts) << facts.error().message();
    if (source == std::string("board")) {
      EXPECT_FALSE(facts->contains("scale"));
      continue;
    }
    const auto coverage = read_file(root_ / "out" / "coverage.json");
    ASSERT_TRUE(coverage);
    const json holes = json::parse(*coverage).at("holes");
    const bool crown =
        std::none_of(holes.begin(), holes.end(), [](const json& hole) { return hole.contains("crown"); });
    ASSERT_EQ(facts->contains("scale"), crown);
    if (crown) {
      const double off = facts->at("scale").at("correction").get<double>() - 1.02;
      EXPECT_LT(std::abs(off), 3 * facts->at("scale").at("uncertainty").get<double>());
    }
  }
}

TEST_F(CloudStage, WithoutCamerasSaysWhatToRun) {
  const auto facts = run();
  ASSERT_FALSE(facts);
  EXPECT_NE(facts.error().message().find("run the cameras stage first"), std::string::npos);
}

TEST_F(CloudStage, TwoViewsAreTooFew) {
  write_cameras(2);
  const auto facts = run();
  ASSERT_FALSE(facts);
  EXPECT_NE(facts.error().message().find("at least 3"), std::string::npos);
}

TEST_F(CloudStage, AMissingKeyframeIsNamed) {
  write_cameras(3);
  std::filesystem::remove(root_ / "frames" / frame_name("body", 10));
  const auto facts = run();
  ASSERT_FALSE(facts);
  EXPECT_NE(facts.error().message().find(frame_name("body", 10)), std::string::npos);
}

// Less memory makes smaller depth maps, and hardly any says how much it takes.
TEST_F(CloudStage, TheMemoryLimitIsObeyed) {
  write_cameras(4, 176);
  const auto all = run({{"spacing_mm", 5.0}});
  ASSERT_TRUE(all) << all.error().message();
  const auto less = run({{"spacing_mm", 5.0}}, 0.105);
  ASSERT_TRUE(less) << less.error().message();
  EXPECT_LT(less->at("depth_mpx").get<double>(), 0.9 * all->at("depth_mpx").get<double>());
  EXPECT_GT(less->at("points").get<int>(), 1000);
  const auto none = run({{"spacing_mm", 5.0}}, 0.1);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message().find("--memory-gib 0.2"), std::string::npos) << none.error().message();
  EXPECT_EQ(run(json::object(), 0.0).error().exit_code(), 2);
}

TEST_F(CloudStage, ASceneWithoutABoxIsAnError) {
  write_cameras(3);
  for (const char* text : {"{}", "no json", R"({"box":{"min":[0,0,0],"max":[0,1,1]}})"}) {
    ASSERT_TRUE(write_file(root_ / "work" / "cameras" / "scene.json", std::string_view(text)));
    EXPECT_FALSE(run()) << text;
  }
}

TEST_F(CloudStage, WrongOptionsAreWrongUse) {
  write_cameras(3);
  for (const json& wrong : {json{{"long_side_px", 10}}, json{{"neighbours", 1}}, json{{"min_views", 1}},
                            json{{"spacing_mm", 0.0}}, json{{"max_points", 1}}, json{{"spacing_mm", "fine"}}}) {
    const auto facts = run(wrong);
    ASSERT_FALSE(facts) << wrong.dump();
    EXPECT_EQ(facts.error().exit_code(), 2) << wrong.dump();
  }
}

}  // namespace
}  // namespace gyre
