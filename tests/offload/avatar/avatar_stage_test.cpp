// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/avatar_stage.h"
#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/template.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

class AvatarStage : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* stage : {"fit", "texture", "cameras", "avatar"}) {
      std::filesystem::create_directories(root_ / "work" / stage);
    }
    body_ = built_in_template();
    template_file_ = root_ / "template.glb";
    ASSERT_TRUE(write_template(body_, template_file_));
    ASSERT_TRUE(write_ply(body_.mesh, root_ / "work/fit/rest.ply"));
    const std::vector<Eigen::Vector3d> joints = joint_positions(body_, body_.mesh.vertices);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      fit_["rest_joints"][body_.joints[j].name] = {joints[j].x(), joints[j].y(), joints[j].z()};
    }
    ASSERT_TRUE(write_file(root_ / "work/fit/fit.json", fit_.dump()));
    ASSERT_TRUE(write_file(root_ / "work/cameras/scene.json", R"({"scale_source":"height"})"));
    cv::imwrite((root_ / "work/texture/albedo.png").string(), cv::Mat(8, 8, CV_8UC3, cv::Scalar(90, 120, 200)));
  }

  Result<nlohmann::json> run() const {
    const Stage stage = avatar_stage();
    StageContext context{.bundle = Bundle(root_), .out = root_ / "work/avatar", .options = stage.options};
    context.options["template"] = template_file_.string();
    context.options.update(options_);
    return stage.run(context);
  }

  TemporaryFolder folder_;
  const std::filesystem::path& root_ = folder_.path();
  std::filesystem::path template_file_;
  BodyTemplate body_;
  nlohmann::json fit_, options_ = nlohmann::json::object();
};

TEST_F(AvatarStage, WritesTheSameFilesTwice) {
  const auto first = run();
  ASSERT_TRUE(first) << first.error().message();
  EXPECT_EQ(first->at("joints"), body_.joints.size());
  std::vector<std::string> files;
  for (const std::string& name : avatar_stage().published) {
    const auto bytes = read_file(root_ / "work/avatar" / name);
    ASSERT_TRUE(bytes) << name;
    files.push_back(*bytes);
  }
  EXPECT_EQ(files.size(), 3U);
  ASSERT_TRUE(run());
  for (std::size_t i = 0; i < files.size(); ++i)
    EXPECT_EQ(files[i], *read_file(root_ / "work/avatar" / avatar_stage().published[i]));
}

TEST_F(AvatarStage, TakesATextureThatIsAJpeg) {
  std::filesystem::remove(root_ / "work/texture/albedo.png");
  cv::imwrite((root_ / "work/texture/albedo.jpg").string(), cv::Mat(8, 8, CV_8UC3, cv::Scalar(90, 120, 200)));
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message();
  const std::string jpeg = *read_file(root_ / "work/texture/albedo.jpg");
  for (const char* name : {"avatar.glb", "avatar.vrm", "avatar.fbx"}) {
    const std::string bytes = *read_file(root_ / "work/avatar" / name);
    EXPECT_NE(bytes.find(jpeg), std::string::npos) << name;
    EXPECT_NE(bytes.find(std::string(name) == "avatar.fbx" ? "albedo.jpg" : "image/jpeg"), std::string::npos) << name;
  }
}

TEST_F(AvatarStage, RefusesANamingItDoesNotKnow) {
  options_["joint_names"] = "maya";
  const auto result = run();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("mixamo"), std::string::npos);
}

TEST_F(AvatarStage, SaysWhichJointIsMissing) {
  fit_["rest_joints"].erase("leftHand");
  ASSERT_TRUE(write_file(root_ / "work/fit/fit.json", fit_.dump()));
  const auto result = run();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("leftHand"), std::string::npos);
}

TEST_F(AvatarStage, SaysWhenTheTextureIsMissing) {
  std::filesystem::remove(root_ / "work/texture/albedo.png");
  const auto result = run();
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("albedo.png"), std::string::npos);
}

}  // namespace
}  // namespace gyre
