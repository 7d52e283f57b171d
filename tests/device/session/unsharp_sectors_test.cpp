// SPDX-License-Identifier: Apache-2.0
#include "device/session/unsharp_sectors.h"

#include <gtest/gtest.h>
#include <cmath>
#include <vector>

namespace gyre {
namespace {

// One turn on the upper ring of the body, ten frames to a sector, sharp but for some sectors.
struct Turn {
  static constexpr int in_sector = 10;
  std::vector<FramePlace> places;
  CoverageMap map;
  Selection selection;

  explicit Turn(const std::vector<int>& unsharp_sectors) {
    for (int i = 0; i < in_sector * CoverageMap::sectors; ++i) {
      const double azimuth = (i + 0.5) / in_sector * 2 * M_PI / CoverageMap::sectors;
      const int sector = i / in_sector;
      const bool is_sharp = std::find(unsharp_sectors.begin(), unsharp_sectors.end(), sector) == unsharp_sectors.end();
      // The seventh of each sector is its sharpest.
      const double quality = (is_sharp ? 0.9 : 0.3) - 0.01 * std::abs(i % in_sector - 7);
      places.push_back({static_cast<float>(azimuth), static_cast<float>(quality), Band::body_upper});
      map.add(azimuth, Band::body_upper, quality, is_sharp, i);
    }
    selection.decisions.resize(places.size());
  }
  void choose(int frame) {
    selection.keyframes.push_back(frame);
    selection.neighbourhoods.push_back({frame});
    selection.decisions[static_cast<std::size_t>(frame)] = {true, "Chosen."};
  }
  void keep(const std::function<bool(int)>& is_kept = [](int) { return true; }) {
    keep_least_bad(selection, unsharp_sectors(map, "body"), places, is_kept);
  }
};

TEST(UnsharpSectors, KeepTheirBestFrameWhenTheyHaveNoKeyframe) {
  Turn turn({3, 5});
  turn.choose(12);
  turn.choose(51);  // in the sixth sector: its own is there
  turn.choose(200);
  turn.keep();
  EXPECT_EQ(turn.selection.keyframes, (std::vector<int>{12, 37, 51, 200}));
  EXPECT_EQ(turn.selection.neighbourhoods[1], std::vector<int>{37});
  EXPECT_TRUE(turn.selection.decisions[37].keyframe);
  EXPECT_NE(turn.selection.decisions[37].reason.find("Least bad"), std::string::npos);
}

TEST(UnsharpSectors, TakeOnlyWhatCanBeHad) {
  Turn turn({3, 8});
  turn.keep([](int i) { return i == 32 || i == 35; });
  EXPECT_EQ(turn.selection.keyframes, std::vector<int>{35});
}

TEST(UnsharpSectors, AreThoseThatWerePassedWithoutASharpFrame) {
  Turn turn({0, 23});
  const std::vector<UnsharpSector> sectors = unsharp_sectors(turn.map, "body");
  ASSERT_EQ(sectors.size(), 2U);  // and none of the lower ring, which nobody went by
  EXPECT_EQ(sectors[0].sector, 0);
  EXPECT_EQ(sectors[1].sector, 23);
  EXPECT_TRUE(unsharp_sectors(turn.map, "head").empty());
}

TEST(UnsharpSectors, FramesWithoutAPlaceLieInNone) {
  Turn turn({3});
  for (FramePlace& place : turn.places) place.azimuth.reset();
  turn.keep();
  EXPECT_TRUE(turn.selection.keyframes.empty());
}

}  // namespace
}  // namespace gyre
