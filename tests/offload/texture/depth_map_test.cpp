// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/depth_map.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(DepthMap, TakesOverTheEdgesOfTheSamePictureFromAnotherPlace) {
  TriangleMesh box;
  scene::add_box(box, {0, 0, 0}, {0.2, 0.3, 0.15}, 4, {0, 0}, 1.0);
  Photo photo = scene::ring(box, scene::painting(box, 64), 1, 1.6).front();
  const DepthMap here = map_depth(box, photo, {});
  photo.cam_from_world.translation.x() += 0.02;
  const DepthMap there = map_depth(box, photo, {});

  DepthMap both = here;
  add_edges(both, there);
  EXPECT_EQ(both.depth, here.depth);
  int lost = 0;
  for (std::size_t i = 0; i < both.edge_distance.size(); ++i) {
    EXPECT_EQ(both.edge_distance[i], std::min(here.edge_distance[i], there.edge_distance[i]));
    if (std::isinf(there.depth[i]) && std::isfinite(here.depth[i])) {
      EXPECT_EQ(both.edge_distance[i], 0);
      ++lost;
    }
  }
  EXPECT_GT(lost, 0);
}

}  // namespace
}  // namespace gyre
