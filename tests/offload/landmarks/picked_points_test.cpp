// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/picked_points.h"

#include "tests/fuzz/fuzz.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <fstream>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

using nlohmann::json;

constexpr const char* sample =
    R"({"version":1,"landmarks":{"noseTip":{"position":[0.01,1.52,0.13]},)"
    R"("leftEyeInner":{"pixels":{"head-000012.jpg":[361.5,402.0],"head-000013.jpg":[350,401]}}}})";

TEST(PickedPoints, ReadsBothKinds) {
  const auto points = picked_from_json(json::parse(sample));
  ASSERT_TRUE(points) << points.error().message();
  ASSERT_EQ(points->size(), 2U);
  EXPECT_EQ(*points->at("noseTip").position, Eigen::Vector3d(0.01, 1.52, 0.13));
  EXPECT_EQ(points->at("leftEyeInner").pixels.at("head-000012.jpg"), Eigen::Vector2d(361.5, 402.0));
  EXPECT_EQ(to_json(*points), json::parse(sample));
}

TEST(PickedPoints, FaultsAreNamed) {
  for (const char* text :
       {"[]", "{}", R"({"version":2,"landmarks":{}})", R"({"version":1})", R"({"version":1,"landmarks":{"tail":{}}})",
        R"({"version":1,"landmarks":{"noseTip":{}}})", R"({"version":1,"landmarks":{"noseTip":{"position":[1,2]}}})",
        R"({"version":1,"landmarks":{"noseTip":{"position":[1,2,"x"]}}})",
        R"({"version":1,"landmarks":{"noseTip":{"position":[1,2,1e9]}}})",
        R"({"version":1,"landmarks":{"noseTip":{"pixels":{"a.jpg":[1]}}}})",
        R"({"version":1,"landmarks":{"noseTip":{"pixel":[1,2]}}})"}) {
    const auto points = picked_from_json(json::parse(text));
    ASSERT_FALSE(points) << text;
    EXPECT_EQ(points.error().kind, Error::Kind::usage) << text;
  }
  const TemporaryFolder folder;
  EXPECT_FALSE(read_picked(folder.path() / "absent.json"));
  std::ofstream(folder.path() / "torn.json") << std::string(sample).substr(0, 40);
  const auto torn = read_picked(folder.path() / "torn.json");
  ASSERT_FALSE(torn);
  EXPECT_NE(torn.error().message().find("torn.json"), std::string::npos);
}

TEST(PickedPoints, DetectorLeavesPicturesToBePlacedAndNamesUnknownOnes) {
  Subject subject;
  subject.views.resize(1);
  subject.views[0].name = "head-000013.jpg";
  auto points = *picked_from_json(json::parse(sample));
  points["chin"].pixels["head-000099.jpg"] = {1, 2};
  PickedDetector detector(points);
  const auto found = detector.detect(subject, [](double, std::string_view) {});
  ASSERT_TRUE(found);
  ASSERT_EQ(found->placed.size(), 1U);
  EXPECT_EQ(found->placed[0].name, "noseTip");
  EXPECT_EQ(found->placed[0].source, "picked");
  ASSERT_EQ(found->pixels.size(), 1U);
  EXPECT_EQ(found->pixels[0].name, "leftEyeInner");
  EXPECT_NE(found->missing.at("chin").find("head-000099.jpg"), std::string::npos);
}

TEST(PickedPointsFuzz, MutatedJsonNeverCrashes) {
  LandmarkSet set;
  set.placed.push_back(
      {"noseTip", {0, 1.5, 0.1}, 1e-6 * Eigen::Matrix3d::Identity(), "geometric", {"head-000001.jpg"}});
  set.missing["chin"] = "a hole";
  set.yaw = 0.5;
  set.yaw_reasons = {"the feet"};
  fuzz({"", "{}", sample, to_json(set).dump(), R"({"version":1,"landmarks":{"chin":{"position":[1e400,0,0]}}})"},
       20'000);
}

}  // namespace
}  // namespace gyre
