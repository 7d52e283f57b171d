// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/hand_paint.h"

#include "offload/texture/colour.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <functional>
#include <optional>

namespace gyre {
namespace {

Canvas canvas_of(const BodyTemplate& body, const Atlas& atlas,
                 const std::function<std::optional<Eigen::Vector3f>(int vertex)>& colour) {
  Canvas canvas;
  canvas.colour.assign(atlas.texels(), Eigen::Vector3f::Zero());
  canvas.origin.assign(atlas.texels(), TexelOrigin::none);
  canvas.photo.assign(atlas.texels(), -1);
  canvas.confidence.assign(atlas.texels(), 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const auto seen = colour(body.mesh.triangles[atlas.triangle[i]][0]);
    if (!seen) continue;
    canvas.colour[i] = *seen;
    canvas.origin[i] = TexelOrigin::strict;
    canvas.photo[i] = 0;
  }
  return canvas;
}

bool is_hand(BodyRegion region) {
  return region == BodyRegion::left_hand || region == BodyRegion::right_hand;
}

class Hands : public testing::Test {
 protected:
  Eigen::Vector3f mean_lab(const HandPaint& paint) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (std::size_t t = 0; t < body_.mesh.triangles.size(); ++t) {
      if (paint.covered()[t] == 0) continue;
      sum += lab_from_bgr(paint.colour(static_cast<int>(t), Eigen::Vector3d::Constant(1.0 / 3.0)));
      ++count;
    }
    return sum / static_cast<float>(std::max(count, 1));
  }

  const BodyTemplate body_ = built_in_template();
  const Atlas atlas_ = map_atlas(body_.mesh.uv, body_.mesh.uv_triangles, 1024, 0);
};

TEST_F(Hands, AreCoveredAndNothingElse) {
  const HandPaint paint(body_);
  int covered = 0;
  for (std::size_t t = 0; t < body_.mesh.triangles.size(); ++t) {
    if (paint.covered()[t] == 0) continue;
    ++covered;
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(is_hand(body_.regions[body_.mesh.triangles[t][k]]));
  }
  EXPECT_GT(covered, 10);
}

TEST_F(Hands, TakeTheColourTheyAreSeenIn) {
  const Eigen::Vector3f dark(60, 80, 110);
  HandPaint paint(body_);
  const Canvas canvas = canvas_of(body_, atlas_, [&](int vertex) -> std::optional<Eigen::Vector3f> {
    return is_hand(body_.regions[vertex]) ? dark : Eigen::Vector3f(200, 40, 40);
  });
  EXPECT_EQ(paint.match(atlas_, canvas), "hands");
  EXPECT_LT((mean_lab(paint) - lab_from_bgr(dark)).norm(), 4.0F);
}

TEST_F(Hands, TakeTheFacesColourWhenNothingElseIsSeen) {
  const Eigen::Vector3f skin(120, 150, 200);
  HandPaint paint(body_);
  const Canvas canvas = canvas_of(body_, atlas_, [&](int vertex) -> std::optional<Eigen::Vector3f> {
    if (body_.regions[vertex] != BodyRegion::face) return std::nullopt;
    return skin;
  });
  const bool has_face = std::find(body_.regions.begin(), body_.regions.end(), BodyRegion::face) != body_.regions.end();
  EXPECT_EQ(paint.match(atlas_, canvas), has_face ? "face" : "");
  if (has_face) {
    EXPECT_LT((mean_lab(paint) - lab_from_bgr(skin)).norm(), 5.0F);
  }
}

TEST_F(Hands, StayNeutralWithoutPhotographs) {
  HandPaint paint(body_);
  const Eigen::Vector3f before = mean_lab(paint);
  EXPECT_EQ(paint.match(atlas_, canvas_of(body_, atlas_, [](int) { return std::nullopt; })), "");
  EXPECT_EQ(mean_lab(paint), before);
}

}  // namespace
}  // namespace gyre
