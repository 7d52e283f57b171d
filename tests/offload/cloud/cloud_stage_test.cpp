// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "ray_scene.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
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

  void write_cameras(int views) {
    const std::filesystem::path cameras = root_ / "work" / "cameras";
    std::filesystem::create_directories(cameras);
    ColmapModel model;
    model.cameras[1] = test::test_camera(112);
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

  Result<json> run(const json& changes = json::object()) const {
    const Stage stage = cloud_stage();
    StageContext ctx{Bundle(root_), root_ / "out", stage.options};
    ctx.options.update(changes);
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
