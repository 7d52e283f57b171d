// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/gradient_blend.h"
#include "offload/texture/bake.h"
#include "offload/texture/texel_graph.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const Progress silent = [](double, std::string_view) {};

// A painted ball in photographs of different exposure that nobody equalises.
class UnevenBall : public testing::Test {
 protected:
  UnevenBall() {
    scene::add_ball(ball_.mesh, 0.25, 16);
    photos_ = scene::ring(ball_.mesh, scene::painting(ball_.mesh, 512), 10, 1.6);
    for (std::size_t p = 0; p < photos_.size(); ++p) photos_[p].image *= 0.85 + 0.05 * static_cast<double>(p % 4);
    options_.size = 512;
    options_.equalise_exposure = false;
  }

  // Mean difference of neighbouring texels: of different photographs, of one, and across borders of charts.
  struct Energy {
    double border = 0, interior = 0, charts = 0;
  };
  Energy energy(const BakedTexture& baked) const {
    const Atlas atlas = map_atlas(ball_.mesh.uv, ball_.mesh.uv_triangles, options_.size, 0);
    const TexelGraph graph = connect_texels(ball_.mesh, atlas, shared_edges(ball_.mesh.triangles),
                                            std::vector<std::uint8_t>(atlas.texels(), 1));
    const auto at = [&](std::int32_t node) {
      return cv::Point(graph.texel[node] % options_.size, graph.texel[node] / options_.size);
    };
    const auto off = [&](std::int32_t a, std::int32_t b) {
      return cv::norm(cv::Vec3f(baked.albedo.at<cv::Vec3b>(at(a))) - cv::Vec3f(baked.albedo.at<cv::Vec3b>(at(b))));
    };
    double sum[3] = {}, count[3] = {};
    const auto add = [&](int kind, double value) {
      sum[kind] += value;
      count[kind] += 1;
    };
    for (std::size_t n = 0; n < graph.texel.size(); ++n) {
      const auto a = static_cast<std::int32_t>(n);
      for (const std::int32_t b : graph.neighbour[n]) {
        if (b < 0) continue;
        add(baked.view.at<std::uint16_t>(at(a)) == baked.view.at<std::uint16_t>(at(b)) ? 1 : 0, off(a, b));
      }
    }
    for (const auto& [a, b] : graph.links) add(2, off(a, b));
    return {sum[0] / count[0], sum[1] / count[1], sum[2] / count[2]};
  }

  BakeSubject ball_;
  std::vector<Photo> photos_;
  BakeOptions options_;
};

TEST_F(UnevenBall, ShowsNoSeams) {
  options_.cut_and_blend = false;
  const auto rough = bake_texture(ball_, photos_, options_, 2, silent);
  options_.cut_and_blend = true;
  const auto smooth = bake_texture(ball_, photos_, options_, 2, silent);
  ASSERT_TRUE(rough && smooth);
  const Energy before = energy(*rough);
  const Energy after = energy(*smooth);
  EXPECT_GT(before.border, 3.0 * before.interior);
  EXPECT_LT(after.border, 1.15 * after.interior);
  EXPECT_LT(after.charts, 2.0 * after.interior);  // linked texels are up to two texels apart on the surface
  EXPECT_NEAR(after.interior, before.interior, 0.2 * before.interior);  // no loss of sharpness
}

TEST_F(UnevenBall, OnePhotographIsLeftAsItIs) {
  photos_.resize(1);
  options_.cut_and_blend = false;
  const auto rough = bake_texture(ball_, photos_, options_, 2, silent);
  options_.cut_and_blend = true;
  const auto smooth = bake_texture(ball_, photos_, options_, 2, silent);
  ASSERT_TRUE(rough && smooth);
  EXPECT_EQ(cv::norm(rough->albedo, smooth->albedo, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace gyre
