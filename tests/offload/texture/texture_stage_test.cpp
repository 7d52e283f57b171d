// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/texture_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/template.h"
#include "tests/offload/texture/scene.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

// The built-in human, painted, in six pictures from a ring.
class TextureStage : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* folder : {"frames", "work/fit", "work/cameras", "work/texture"}) {
      std::filesystem::create_directories(root_ / folder);
    }
    const BodyTemplate body = built_in_template();
    ASSERT_TRUE(write_template(body, root_ / "template.glb"));
    ASSERT_TRUE(write_ply(body.mesh, root_ / "work/fit/posed.ply"));
    const cv::Mat painting = scene::painting(body.mesh, 512);
    ColmapModel model;
    model.cameras[1] = scene::camera();
    for (int k = 0; k < 6; ++k) {
      const double yaw = k * M_PI / 3;
      ModelImage image;
      image.name = frame_name("body", k);
      image.cam_from_world = look_at({3.5 * std::sin(yaw), 1.2, 3.5 * std::cos(yaw)}, {0, 0.9, 0});
      cv::imwrite((root_ / "frames" / image.name).string(),
                  render(body.mesh, painting, model.cameras[1], image.cam_from_world, {.lit = false}));
      model.images[k + 1] = image;
    }
    ASSERT_TRUE(write_colmap_model(model, root_ / "work/cameras"));
  }

  Result<nlohmann::json> run(int size, const nlohmann::json& more = nlohmann::json::object()) const {
    const Stage stage = texture_stage();
    StageContext context{.bundle = Bundle(root_), .out = root_ / "work/texture", .options = stage.options};
    context.options["template"] = (root_ / "template.glb").string();
    context.options["size"] = size;
    context.options.update(more);
    return stage.run(context);
  }

  TemporaryFolder folder_;
  const std::filesystem::path& root_ = folder_.path();
};

TEST_F(TextureStage, WritesTextureSourceAndFacts) {
  const auto facts = run(1024);
  ASSERT_TRUE(facts) << facts.error().message();
  EXPECT_EQ(facts->at("views"), 6);
  EXPECT_EQ(cv::imread((root_ / "work/texture/albedo.png").string()).rows, 1024);
  EXPECT_EQ(cv::imread((root_ / "work/texture/source.png").string()).rows, 1024);
  const auto text = read_file(root_ / "work/texture/texture.json");
  ASSERT_TRUE(text);
  const nlohmann::json written = nlohmann::json::parse(*text);
  double total = 0;
  for (const auto& [name, value] : written.at("share").items()) total += value.get<double>();
  EXPECT_NEAR(total, 1.0, 1e-9);
  EXPECT_GT(written.at("share").at("within_45_deg").get<double>(), 0.3);
}

TEST_F(TextureStage, WritesAJpegWhenAskedTo) {
  ASSERT_TRUE(run(1024));
  const cv::Mat exact = cv::imread((root_ / "work/texture/albedo.png").string());
  std::filesystem::remove(root_ / "work/texture/albedo.png");
  ASSERT_TRUE(run(1024, {{"format", "jpeg"}}));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work/texture/albedo.png"));
  const cv::Mat packed = cv::imread((root_ / "work/texture/albedo.jpg").string());
  ASSERT_EQ(packed.size(), exact.size());
  EXPECT_LT(cv::norm(packed, exact, cv::NORM_L1) / static_cast<double>(3 * exact.total()), 1.5);
  const auto refused = run(1024, {{"format", "gif"}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().exit_code(), 2);
}

TEST_F(TextureStage, RefusesOddSizes) {
  const auto result = run(500);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().exit_code(), 2);
}

TEST_F(TextureStage, NamesTheKeyframeThatIsMissing) {
  std::filesystem::remove(root_ / "frames" / frame_name("body", 3));
  const auto result = run(1024);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find(frame_name("body", 3)), std::string::npos);
}

}  // namespace
}  // namespace gyre
