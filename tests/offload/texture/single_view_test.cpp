// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/single_view.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(SingleView, AFeatureComesFromThePhotographThatShowsMostOfIt) {
  // Photograph 0 is best on two triangles and blind on the third; photograph 1 sees them all. The fourth is elsewhere.
  ObservationTable table;
  const auto see = [&](int photo, float score) {
    Observation o;
    o.photo = photo;
    o.quality = ViewQuality::strict;
    o.score = score;
    o.colour.setConstant(100.0F);
    table.all.push_back(o);
  };
  for (int t = 0; t < 4; ++t) {
    table.start.push_back(table.all.size());
    if (t != 2) see(0, 2.0F);
    see(1, 1.8F);
  }
  table.start.push_back(table.all.size());
  auto candidates = label_candidates(table, {});
  const std::vector<std::uint8_t> feature = {1, 1, 1, 0};
  hold_to_one_view(table, feature, candidates);
  for (int t = 0; t < 3; ++t) {
    ASSERT_EQ(candidates[t].size(), 1U);
    EXPECT_EQ(candidates[t][0].photo, 1);
  }
  EXPECT_EQ(candidates[3].size(), 2U);
  EXPECT_EQ(candidates[3][0].photo, 0);
}

TEST(SingleView, FeaturesLieAroundTheirLandmarks) {
  BodyTemplate body;
  body.mesh.vertices = {{0.02, 1.5, 0.1}, {0.05, 1.5, 0.1}, {0.035, 1.51, 0.1}, {0.035, 1.2, 0.1}, {0.04, 1.2, 0.1}};
  body.mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
  body.landmarks = {{"leftEyeInner", 0}, {"leftEyeOuter", 1}};
  EXPECT_EQ(face_features(body), (std::vector<std::uint8_t>{1, 0}));
  body.landmarks.clear();
  EXPECT_EQ(face_features(body), (std::vector<std::uint8_t>{0, 0}));
}

}  // namespace
}  // namespace gyre
