// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/coverage_map.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(CoverageMap, SectorsGoAroundFromTheStart) {
  EXPECT_EQ(CoverageMap::sector_of(0.0), 0);
  EXPECT_EQ(CoverageMap::sector_of(-1e-9), CoverageMap::sectors - 1);
  EXPECT_EQ(CoverageMap::sector_of(2 * M_PI + 0.01), 0);
  EXPECT_EQ(CoverageMap::sector_of(M_PI + 0.01), CoverageMap::sectors / 2);
}

TEST(CoverageMap, NoSectorIsCoveredWithoutASharpFrame) {
  CoverageMap map;
  map.add(0.1, Band::body_upper, 0.3, false, 7);
  map.add(0.1, Band::body_upper, 0.4, false, 8);
  map.add(0.1, Band::body_upper, 0.2, false, 9);
  EXPECT_FALSE(map.cell(Band::body_upper, 0).is_covered());
  EXPECT_EQ(map.cell(Band::body_upper, 0).best_frame, 8) << "the least bad one";
  EXPECT_EQ(map.unsharp(Band::body_upper), std::vector<int>{0});
  EXPECT_EQ(map.gaps(Band::body_upper).size(), static_cast<std::size_t>(CoverageMap::sectors));
  map.add(0.1, Band::body_upper, 0.9, true, 10);
  EXPECT_TRUE(map.cell(Band::body_upper, 0).is_covered());
  EXPECT_TRUE(map.unsharp(Band::body_upper).empty());
  EXPECT_FALSE(map.cell(Band::body_lower, 0).is_covered());
}

TEST(CoverageMap, SharesReachOne) {
  CoverageMap map;
  for (int i = 0; i < CoverageMap::sectors; ++i) {
    EXPECT_NEAR(map.share(Band::head_ring), static_cast<double>(i) / CoverageMap::sectors, 1e-12);
    map.add((i + 0.5) * 2 * M_PI / CoverageMap::sectors, Band::head_ring, 1.0, true, i);
  }
  EXPECT_EQ(map.share(Band::head_ring), 1.0);
  EXPECT_TRUE(map.gaps(Band::head_ring).empty());
  for (int i = 0; i < 6; ++i) map.add(0.0, Band::crown, 1.0, true, 100 + i);
  EXPECT_EQ(map.share(Band::crown), 1.0);
}

TEST(Bands, ACameraNearABorderStaysWhereItIs) {
  OrbitPlace place;
  std::optional<Band> band;
  int changes = 0;
  // Down through the border with a hand that trembles by less than the border is wide.
  for (int i = 0; i < 400; ++i) {
    place.height = -0.001 * i + (i % 2 == 0 ? 0.02 : -0.02);
    const Band now = band_of("body", place, band);
    if (band && now != *band) ++changes;
    band = now;
  }
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(band, Band::body_lower);
  EXPECT_EQ(band_of("head", {.elevation = 0.7}, std::nullopt), Band::crown);
  EXPECT_EQ(band_of("head", {.elevation = -0.7}, std::nullopt), Band::chin);
  EXPECT_EQ(band_of("head", {}, std::nullopt), Band::head_ring);
}

}  // namespace
}  // namespace gyre
