// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/mirror.h"
#include "offload/texture/bake.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr int size = 256;

// A symmetric box, painted alike on both sides; nobody has seen the side towards -X and parts of the front's left half.
class HalfSeenBox : public testing::Test {
 protected:
  HalfSeenBox() {
    scene::add_box(mesh_, {0, 0, 0}, {0.2, 0.3, 0.15}, 8, {0, 0}, 1.0);
    // Diagonals that mirror each other.
    for (std::size_t t = 0; t + 1 < mesh_.triangles.size(); t += 2) {
      if (middle(t).x() + middle(t + 1).x() >= 0) continue;
      for (auto* triangles : {&mesh_.triangles, &mesh_.uv_triangles}) {
        const Eigen::Vector3i a = (*triangles)[t], b = (*triangles)[t + 1];  // (p, q, r), (p, r, s)
        (*triangles)[t] = {a[0], a[1], b[2]};
        (*triangles)[t + 1] = {a[1], a[2], b[2]};
      }
    }
    for (const Eigen::Vector3d& v : mesh_.vertices) {
      const auto found = std::find_if(mesh_.vertices.begin(), mesh_.vertices.end(), [&](const Eigen::Vector3d& w) {
        return (w - Eigen::Vector3d(-v.x(), v.y(), v.z())).norm() < 1e-9;
      });
      mirror_.push_back(static_cast<int>(found - mesh_.vertices.begin()));
    }
    atlas_ = map_atlas(mesh_.uv, mesh_.uv_triangles, size, 2);
    canvas_.colour.assign(atlas_.texels(), Eigen::Vector3f::Zero());
    canvas_.origin.assign(atlas_.texels(), TexelOrigin::none);
    canvas_.photo.assign(atlas_.texels(), -1);
    canvas_.confidence.assign(atlas_.texels(), 0);
    for (std::size_t i = 0; i < atlas_.texels(); ++i) {
      if (atlas_.triangle[i] < 0 || hidden(i)) continue;
      canvas_.colour[i] = truth(i);
      canvas_.origin[i] = TexelOrigin::strict;
      canvas_.photo[i] = 0;
      canvas_.confidence[i] = 200;
    }
  }

  Eigen::Vector3d middle(std::size_t t) const {
    const Eigen::Vector3i& c = mesh_.triangles[t];
    return (mesh_.vertices[c[0]] + mesh_.vertices[c[1]] + mesh_.vertices[c[2]]) / 3.0;
  }
  Eigen::Vector3d point(std::size_t texel) const { return texel_point(mesh_, atlas_, texel); }
  bool hidden(std::size_t texel) const {
    const Eigen::Vector3d p = point(texel);
    return p.x() < -0.199 || (p.x() < -0.06 && p.y() > 0 && p.z() > 0.149);
  }
  Eigen::Vector3f truth(std::size_t texel) const {
    Eigen::Vector3d p = point(texel);
    p.x() = std::abs(p.x());
    const cv::Vec3b c = scene::colour_at(p);
    return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
  }
  void fill() {
    fill_mirrored(mesh_, atlas_, shared_edges(mesh_.triangles), mirror_,
                  std::vector<std::uint8_t>(mesh_.triangles.size(), 0), 2, canvas_);
  }

  TriangleMesh mesh_;
  std::vector<int> mirror_;
  Atlas atlas_;
  Canvas canvas_;
};

TEST_F(HalfSeenBox, TakesTheOtherSide) {
  fill();
  double sum = 0;
  int mirrored = 0, missing = 0;
  for (std::size_t i = 0; i < atlas_.texels(); ++i) {
    if (atlas_.triangle[i] < 0 || !hidden(i)) continue;
    if (canvas_.origin[i] != TexelOrigin::mirrored) {
      ++missing;  // the rim has no four texels to take
      continue;
    }
    ++mirrored;
    sum += (canvas_.colour[i] - truth(i)).cwiseAbs().maxCoeff();
    EXPECT_EQ(canvas_.confidence[i], 100);
  }
  EXPECT_GT(mirrored, 20 * missing);
  EXPECT_LT(sum / mirrored, 2.0);
}

TEST_F(HalfSeenBox, FitsItselfToTheLightOfItsSurroundings) {
  for (std::size_t i = 0; i < atlas_.texels(); ++i) {
    if (atlas_.triangle[i] >= 0 && !hidden(i) && point(i).x() < 0) canvas_.colour[i].array() -= 30.0F;
  }
  fill();
  double sum = 0;
  int mirrored = 0;
  for (std::size_t i = 0; i < atlas_.texels(); ++i) {
    // Of the front, which dark texels surround but for the edge to the hidden side.
    if (canvas_.origin[i] != TexelOrigin::mirrored || point(i).z() < 0.149 || point(i).x() < -0.19) continue;
    sum += canvas_.colour[i][1] - truth(i)[1];
    ++mirrored;
  }
  EXPECT_NEAR(sum / mirrored, -30.0, 6.0);
}

}  // namespace
}  // namespace gyre
