// SPDX-License-Identifier: Apache-2.0
#include "offload/body/landmark_set.h"

#include "offload/body/template.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

LandmarkSet sample() {
  LandmarkSet set;
  PlacedLandmark nose;
  nose.name = "noseTip";
  nose.position = {0.001, 1.52, 0.1303};
  nose.covariance << 4e-6, 1e-6, 0, 1e-6, 4e-6, 0, 0, 0, 1e-6;
  nose.source = "geometric";
  nose.views = {"head-000012.jpg", "head-000030.jpg"};
  set.placed.push_back(nose);
  set.missing["leftToe"] = "the cloud has a hole there";
  set.yaw = 0.25;
  set.yaw_certainty = 0.9;
  set.yaw_reasons = {"the feet point there"};
  return set;
}

TEST(LandmarkSet, ReadsWhatWasWritten) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "landmarks.json";
  ASSERT_TRUE(write_landmarks(sample(), file));
  const auto read = read_landmarks(file);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->placed.size(), 1U);
  const PlacedLandmark& nose = read->placed[0];
  EXPECT_EQ(nose.name, "noseTip");
  EXPECT_EQ(nose.position, sample().placed[0].position);
  EXPECT_EQ(nose.covariance, sample().placed[0].covariance);
  EXPECT_EQ(nose.views, sample().placed[0].views);
  EXPECT_EQ(read->missing, sample().missing);
  ASSERT_TRUE(read->yaw);
  EXPECT_NEAR(*read->yaw, 0.25, 1e-12);
  EXPECT_EQ(read->yaw_certainty, 0.9);
  EXPECT_EQ(read->yaw_reasons, sample().yaw_reasons);
  EXPECT_EQ(read->find("noseTip"), &read->placed[0]);
  EXPECT_EQ(read->find("leftToe"), nullptr);
}

TEST(LandmarkSet, UndecidedFacingStaysUndecided) {
  LandmarkSet set = sample();
  set.yaw.reset();
  const auto read = landmarks_from_json(to_json(set));
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->yaw);
}

TEST(LandmarkSet, FaultsAreErrors) {
  const auto broken = [](const std::function<void(nlohmann::json&)>& change) {
    nlohmann::json json = to_json(sample());
    change(json);
    return !landmarks_from_json(json);
  };
  EXPECT_FALSE(broken([](nlohmann::json&) {}));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["version"] = 2; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j.erase("missing"); }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j.erase("facing"); }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["missing"]["noseTip"] = "twice"; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["missing"]["leftToe"] = 3; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["position"] = {1, 2}; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["position"][0] = nullptr; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["position"][0] = 1e300; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["covariance"][1] = 5e-6; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["covariance"][0] = -1e-6; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["source"] = "guessed"; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"]["noseTip"]["views"] = "head"; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["landmarks"][""] = j["landmarks"]["noseTip"]; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["facing"]["certainty"] = 1.5; }));
  EXPECT_TRUE(broken([](nlohmann::json& j) { j["facing"]["yaw_deg"] = "north"; }));
}

TEST(LandmarkSet, NamesCoverTheBuiltInTemplate) {
  const std::vector<std::string>& names = landmark_names();
  for (const auto& [name, vertex] : built_in_template().landmarks)
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
}

}  // namespace
}  // namespace gyre
