// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/merge.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

class FixedDetector : public LandmarkDetector {
 public:
  FixedDetector(std::string source, std::vector<std::pair<std::string, Eigen::Vector3d>> marks,
                std::map<std::string, std::string> missing = {})
      : source_(std::move(source)), marks_(std::move(marks)), missing_(std::move(missing)) {}
  std::string source() const override { return source_; }
  Result<Detections> detect(const Subject& /*subject*/, const Progress& /*progress*/) override {
    Detections found;
    for (const auto& [name, place] : marks_)
      found.placed.push_back({name, place, 1e-6 * Eigen::Matrix3d::Identity(), source_, {}});
    found.missing = missing_;
    return found;
  }

 private:
  std::string source_;
  std::vector<std::pair<std::string, Eigen::Vector3d>> marks_;
  std::map<std::string, std::string> missing_;
};

// Somebody who faces +Z, the left at +X.
Subject somebody() {
  Subject subject;
  subject.figure.height = 1.7;
  subject.facing.towards_across = true;
  subject.facing.certainty = 0.9;
  return subject;
}

Result<LandmarkSet> merged(const Subject& subject, std::vector<std::unique_ptr<LandmarkDetector>> detectors) {
  return detect_landmarks(subject, detectors, [](double, std::string_view) {});
}

template <class... Detectors>
std::vector<std::unique_ptr<LandmarkDetector>> list(Detectors... detectors) {
  std::vector<std::unique_ptr<LandmarkDetector>> all;
  (all.push_back(std::make_unique<FixedDetector>(std::move(detectors))), ...);
  return all;
}

TEST(Merge, PickedBeatsNetworkBeatsGeometry) {
  const auto set = merged(
      somebody(), list(FixedDetector("geometric", {{"noseTip", {0, 1, 0}}, {"chin", {0, 1, 0}}, {"crown", {0, 1, 0}}},
                                     {{"leftEar", "hair"}, {"rightEar", "hair"}}),
                       FixedDetector("network", {{"noseTip", {0, 2, 0}}, {"chin", {0, 2, 0}}},
                                     {{"crown", "not one of its keypoints"}}),
                       FixedDetector("picked", {{"noseTip", {0, 3, 0}}, {"leftEar", {0.1, 3, 0}}})));
  ASSERT_TRUE(set);
  EXPECT_EQ(set->placed.size(), 4U);
  EXPECT_EQ(set->find("noseTip")->source, "picked");
  EXPECT_EQ(set->find("chin")->source, "network");
  EXPECT_EQ(set->find("crown")->source, "geometric");
  EXPECT_EQ(set->find("leftEar")->source, "picked");
  // What one detector could not place another did.
  EXPECT_EQ(set->missing, (std::map<std::string, std::string>{{"rightEar", "hair"}}));
  EXPECT_TRUE(set->yaw);
}

TEST(Merge, ANetworkThatTakesLeftForRightIsNotHeard) {
  const auto set =
      merged(somebody(), list(FixedDetector("network", {{"leftHeel", {-0.1, 0, 0}}, {"rightHeel", {0.1, 0, 0}}})));
  ASSERT_TRUE(set);
  EXPECT_TRUE(set->placed.empty());
  EXPECT_LT(set->yaw_certainty, 0.5);
}

TEST(Merge, UndecidedFacingStaysOpen) {
  Subject subject = somebody();
  subject.facing.towards_across.reset();
  const auto set = merged(subject, list(FixedDetector("geometric", {{"crown", {0, 1.7, 0}}})));
  ASSERT_TRUE(set);
  EXPECT_FALSE(set->yaw);
}

}  // namespace
}  // namespace gyre
