// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/insertion.h"

#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr int size = 128;

// A grey box whose upper part is inserted, 40 levels too bright and striped.
class Insertion : public testing::Test {
 protected:
  Insertion() {
    scene::add_box(mesh_, {0, 0, 0}, {0.2, 0.3, 0.15}, 8, {0, 0}, 1.0);
    atlas_ = map_atlas(mesh_.uv, mesh_.uv_triangles, size, 2);
    canvas_.colour.assign(atlas_.texels(), Eigen::Vector3f::Zero());
    canvas_.origin.assign(atlas_.texels(), TexelOrigin::none);
    canvas_.photo.assign(atlas_.texels(), -1);
    canvas_.confidence.assign(atlas_.texels(), 0);
    inserted_.assign(atlas_.texels(), 0);
    for (std::size_t i = 0; i < atlas_.texels(); ++i) {
      if (atlas_.triangle[i] < 0) continue;
      inserted_[i] = height(i) > 0 ? 1 : 0;
      canvas_.origin[i] = inserted_[i] != 0 ? TexelOrigin::generated : TexelOrigin::strict;
      canvas_.photo[i] = inserted_[i] != 0 ? -1 : 0;
      canvas_.colour[i].setConstant(inserted_[i] != 0 ? 140.0F + stripe(i) : 100.0F);
    }
  }

  // By triangles, so that a border of triangles is a border of the insertion.
  double height(std::size_t texel) const {
    const Eigen::Vector3i& c = mesh_.triangles[atlas_.triangle[texel]];
    return mesh_.vertices[c[0]].y() + mesh_.vertices[c[1]].y() + mesh_.vertices[c[2]].y();
  }
  float stripe(std::size_t texel) const { return texel % 4 < 2 ? 5.0F : -5.0F; }

  TriangleMesh mesh_;
  Atlas atlas_;
  Canvas canvas_;
  std::vector<std::uint8_t> inserted_;
};

TEST_F(Insertion, LosesTheStepAndKeepsTheStripes) {
  insert_texels(mesh_, atlas_, shared_edges(mesh_.triangles), inserted_, 0.0, 2, canvas_);
  for (std::size_t i = 0; i < atlas_.texels(); ++i) {
    if (atlas_.triangle[i] < 0) continue;
    if (inserted_[i] == 0) {
      EXPECT_EQ(canvas_.colour[i][0], 100.0F);
    } else {
      EXPECT_NEAR(canvas_.colour[i][0] - stripe(i), 100.0F, 6.0F);
    }
  }
}

TEST_F(Insertion, FadesWithinItsReach) {
  insert_texels(mesh_, atlas_, shared_edges(mesh_.triangles), inserted_, 3.0, 2, canvas_);
  float least = 255, most = 0;
  for (std::size_t i = 0; i < atlas_.texels(); ++i) {
    if (atlas_.triangle[i] < 0 || inserted_[i] == 0) continue;
    least = std::min(least, canvas_.colour[i][0] - stripe(i));
    most = std::max(most, canvas_.colour[i][0] - stripe(i));
  }
  EXPECT_LT(least, 120.0F);
  EXPECT_GT(most, 138.0F);
}

}  // namespace
}  // namespace gyre
