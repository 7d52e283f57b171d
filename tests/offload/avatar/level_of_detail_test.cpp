// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/level_of_detail.h"

#include "common/mesh/closest_point.h"

#include <gtest/gtest.h>
#include <map>
#include <set>

namespace gyre {
namespace {

// The built-in human, whose raised brow is a single vertex.
Avatar human() {
  BodyTemplate body = built_in_template();
  body.expressions = {{"browInnerUp", {body.landmarks.at("noseTip")}, {{0, 0.01F, 0}}}};
  return *assemble_avatar(body, body.mesh.vertices, joint_positions(body, body.mesh.vertices));
}

using Key = std::array<float, 5>;

Key key_of(const Avatar& avatar, std::size_t v) {
  const Eigen::Vector3f& p = avatar.positions[v];
  return {p.x(), p.y(), p.z(), avatar.uv[v].x(), avatar.uv[v].y()};
}

// Places with texture coordinates where the surface ends: seams.
std::set<std::pair<Key, Key>> border(const Avatar& avatar) {
  std::map<std::pair<int, int>, int> edges;
  for (const Eigen::Vector3i& t : avatar.triangles)
    for (int k = 0; k < 3; ++k) {
      ++edges[{t[k], t[(k + 1) % 3]}];
      --edges[{t[(k + 1) % 3], t[k]}];
    }
  std::set<std::pair<Key, Key>> found;
  for (const auto& [edge, balance] : edges)
    if (balance > 0) found.emplace(key_of(avatar, edge.first), key_of(avatar, edge.second));
  return found;
}

TEST(Reduced, KeepsVerticesAsTheyAre) {
  const Avatar avatar = human();
  const auto half = reduced(avatar, 0.5);
  ASSERT_TRUE(half);
  EXPECT_LE(half->triangles.size(), avatar.triangles.size() / 2 + 1);
  std::map<Key, std::size_t> all;
  for (std::size_t v = 0; v < avatar.positions.size(); ++v) all[key_of(avatar, v)] = v;
  for (std::size_t v = 0; v < half->positions.size(); ++v) {
    const auto found = all.find(key_of(*half, v));
    ASSERT_NE(found, all.end());
    EXPECT_EQ(half->skin[v].joint, avatar.skin[found->second].joint);
    EXPECT_EQ(half->skin[v].weight, avatar.skin[found->second].weight);
    EXPECT_EQ(half->morphs[0].positions[v], avatar.morphs[0].positions[found->second]);
  }
}

TEST(Reduced, OpensNoSeam) {
  const Avatar avatar = human();
  EXPECT_EQ(border(*reduced(avatar, 0.5)), border(avatar));
}

TEST(Reduced, StaysCloseToTheSurface) {
  const Avatar avatar = human();
  const auto half = reduced(avatar, 0.5);
  ASSERT_TRUE(half);
  TriangleMesh mesh;
  for (const Eigen::Vector3f& p : half->positions) mesh.vertices.emplace_back(p.cast<double>());
  mesh.triangles = half->triangles;
  const ClosestPoint surface(mesh);
  double sum = 0;
  for (const Eigen::Vector3f& p : avatar.positions) {
    const auto nearest = surface.nearest(p.cast<double>());
    ASSERT_TRUE(nearest);
    EXPECT_LT(nearest->distance, 0.01);
    sum += nearest->distance;
  }
  EXPECT_LT(sum / static_cast<double>(avatar.positions.size()), 0.001);
}

TEST(Reduced, KeepsWhatExpressionsMove) {
  const auto half = reduced(human(), 0.5);
  ASSERT_TRUE(half);
  float most = 0;
  for (const Eigen::Vector3f& offset : half->morphs[0].positions) most = std::max(most, offset.norm());
  EXPECT_EQ(most, 0.01F);
}

TEST(Reduced, RefusesAnImpossibleShare) {
  EXPECT_FALSE(reduced(human(), 0.0));
  EXPECT_FALSE(reduced(human(), 1.5));
  EXPECT_EQ(reduced(human(), 1.0)->triangles.size(), human().triangles.size());
}

}  // namespace
}  // namespace gyre
