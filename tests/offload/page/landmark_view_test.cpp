// SPDX-License-Identifier: Apache-2.0
#include "offload/page/landmark_view.h"

#include "common/geometry/colmap_model.h"
#include "offload/body/landmark_set.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <numbers>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class LandmarkViewTest : public ::testing::Test {
 protected:
  // One camera two metres to the subject's left, which sees its nose; the subject faces +Z.
  void SetUp() override {
    ColmapModel model;
    Camera camera;
    camera.width = 400;
    camera.height = 600;
    camera.fx = camera.fy = 500;
    camera.cx = 200;
    camera.cy = 300;
    model.cameras[1] = camera;
    ModelImage image;
    image.name = "body-000001.jpg";
    // Its x points to -Z, its y down, its z to -X.
    Eigen::Matrix3d rotation;
    rotation << 0, 0, -1, 0, -1, 0, -1, 0, 0;
    image.cam_from_world.rotation = Eigen::Quaterniond(rotation);
    image.cam_from_world.translation = Eigen::Vector3d(0, 1.5, 2);
    model.images[1] = image;
    fs::create_directories(bundle_.work("cameras"));
    fs::create_directories(bundle_.work("landmarks"));
    ASSERT_TRUE(write_colmap_model(model, bundle_.work("cameras")));
    LandmarkSet set;
    PlacedLandmark nose;
    nose.name = "noseTip";
    nose.position = Eigen::Vector3d(0, 1.6, 0.1);
    nose.source = "geometric";
    set.placed.push_back(nose);
    set.missing["crown"] = "the hair covers it.";
    set.yaw = 0.0;
    ASSERT_TRUE(write_landmarks(set, bundle_.work("landmarks") / "landmarks.json"));
  }

  TemporaryFolder folder_;
  Bundle bundle_{folder_.path() / "scan"};
};

TEST_F(LandmarkViewTest, SaysWhereTheLandmarksAreInTheKeyframes) {
  const json view = landmark_view(bundle_);
  EXPECT_EQ(view.at("placed"), json({{"noseTip", "geometric"}}));
  EXPECT_EQ(view.at("missing"), json({{"crown", "the hair covers it."}}));
  ASSERT_EQ(view.at("frames").size(), 1U);
  const json& frame = view.at("frames")[0];
  EXPECT_EQ(frame.at("name"), "body-000001.jpg");
  EXPECT_NEAR(frame.at("azimuth_deg").get<double>(), 90.0, 1e-9);
  // In the camera: (-0.1, -0.1, 2).
  EXPECT_NEAR(frame.at("pixels").at("noseTip")[0].get<double>(), 175.0, 1e-9);
  EXPECT_NEAR(frame.at("pixels").at("noseTip")[1].get<double>(), 275.0, 1e-9);
}

TEST_F(LandmarkViewTest, KeepsWhatWasPicked) {
  const json picked = {{"version", 1}, {"landmarks", {{"crown", {{"pixels", {{"body-000001.jpg", {10.5, 20.5}}}}}}}}};
  ASSERT_TRUE(keep_picked(bundle_, picked));
  EXPECT_EQ(landmark_view(bundle_).at("picked"), picked.at("landmarks"));
  EXPECT_FALSE(keep_picked(bundle_, {{"version", 1}, {"landmarks", {{"third eye", {{"position", {0, 0, 0}}}}}}}));
  EXPECT_EQ(landmark_view(bundle_).at("picked"), picked.at("landmarks"));
  ASSERT_TRUE(keep_picked(bundle_, {{"version", 1}, {"landmarks", json::object()}}));
  EXPECT_FALSE(fs::exists(picked_file(bundle_)));
}

TEST(LandmarkView, OfAScanWithoutCamerasHasNoFrames) {
  const TemporaryFolder folder;
  const json view = landmark_view(Bundle(folder.path()));
  EXPECT_TRUE(view.at("frames").empty());
  EXPECT_FALSE(view.at("names").empty());
}

}  // namespace
}  // namespace gyre
