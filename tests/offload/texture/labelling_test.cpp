// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/labelling.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A flat strip of squares in front of three cameras whose pictures are plain colours.
class FlatStrip : public testing::Test {
 protected:
  FlatStrip() {
    for (int i = 0; i <= 12; ++i) {
      for (const double y : {0.0, 0.05}) vertices_.emplace_back(0.05 * i - 0.3, y, 0);
    }
    for (int i = 0; i < 12; ++i) {
      triangles_.emplace_back(2 * i, 2 * i + 2, 2 * i + 3);
      triangles_.emplace_back(2 * i, 2 * i + 3, 2 * i + 1);
    }
    for (const int level : {100, 104, 200}) {
      Photo photo;
      photo.camera = scene::camera();
      photo.cam_from_world = look_at({0, 0, 2}, {0, 0, 0});
      photo.image = cv::Mat(320, 320, CV_8UC3, cv::Scalar::all(level));
      photos_.push_back(photo);
    }
  }

  double energy(const std::vector<std::vector<Candidate>>& candidates, const std::vector<int>& label) const {
    double sum = 0;
    for (std::size_t f = 0; f < label.size(); ++f) {
      for (const Candidate& c : candidates[f]) sum += c.photo == label[f] ? c.cost : 0.0;
    }
    for (const SharedEdge& e : shared_edges(triangles_)) {
      const int a = label[e.face[0]];
      const int b = label[e.face[1]];
      if (a < 0 || b < 0 || a == b) continue;
      const int levels[] = {100, 104, 200};
      sum += options_.seam_length + options_.seam_colour * std::abs(levels[a] - levels[b]) / 255.0;
    }
    return sum;
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Photo> photos_;
  LabelOptions options_;
};

TEST_F(FlatStrip, RemovesLonelyLabelsThatBarelyPay) {
  std::vector<std::vector<Candidate>> candidates(triangles_.size());
  for (std::size_t f = 0; f < candidates.size(); ++f) {
    const int better = f % 5 == 2 ? 1 : 0;
    candidates[f] = {{better, 0.0F, ViewQuality::strict}, {1 - better, 0.03F, ViewQuality::strict}};
  }
  const std::vector<int> label = choose_photos(vertices_, shared_edges(triangles_), candidates, photos_, options_);
  for (const int l : label) EXPECT_EQ(l, label.front());
}

TEST_F(FlatStrip, NeverEndsAboveTheBestViewAndIsExactHere) {
  std::vector<std::vector<Candidate>> candidates(triangles_.size());
  for (std::size_t f = 0; f < candidates.size(); ++f) {
    for (int p = 0; p < 3; ++p) {
      const float cost = static_cast<float>((f * 7 + p * 11 + f * p * 3) % 13) / 13.0F;
      candidates[f].push_back({p, cost, ViewQuality::strict});
    }
    std::sort(candidates[f].begin(), candidates[f].end(), [](auto& a, auto& b) { return a.cost < b.cost; });
  }
  std::vector<int> best;
  for (const auto& c : candidates) best.push_back(c.front().photo);
  const std::vector<SharedEdge> edges = shared_edges(triangles_);
  const std::vector<int> label = choose_photos(vertices_, edges, candidates, photos_, options_);
  EXPECT_LT(energy(candidates, label), energy(candidates, best));
  // No single expansion move of one triangle may improve the result.
  for (std::size_t f = 0; f < label.size(); ++f) {
    for (int p = 0; p < 3; ++p) {
      std::vector<int> other = label;
      other[f] = p;
      EXPECT_GE(energy(candidates, other), energy(candidates, label) - 1e-4);
    }
  }
}

TEST_F(FlatStrip, LeavesTrianglesWithoutCandidates) {
  std::vector<std::vector<Candidate>> candidates(triangles_.size());
  candidates[3] = {{2, 0.0F, ViewQuality::loose}};
  const std::vector<int> label = choose_photos(vertices_, shared_edges(triangles_), candidates, photos_, options_);
  for (std::size_t f = 0; f < label.size(); ++f) EXPECT_EQ(label[f], f == 3 ? 2 : -1);
}

TEST(LabelCandidates, PrefersStrictViewsAndDistrustsTheOddOne) {
  const auto observation = [](int photo, ViewQuality quality, float score, float level) {
    Observation o;
    o.photo = photo;
    o.quality = quality;
    o.score = score;
    o.colour.setConstant(level);
    return o;
  };
  ObservationTable table;
  table.start = {0, 4};
  table.all = {observation(0, ViewQuality::loose, 9.0F, 100), observation(1, ViewQuality::strict, 2.0F, 250),
               observation(2, ViewQuality::strict, 1.5F, 101), observation(3, ViewQuality::strict, 1.4F, 99)};
  const auto candidates = label_candidates(table, {});
  ASSERT_EQ(candidates[0].size(), 3U);
  EXPECT_EQ(candidates[0][0].photo, 2);
  EXPECT_EQ(candidates[0][2].photo, 1);
}

}  // namespace
}  // namespace gyre
