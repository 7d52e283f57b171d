// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/coverage.h"

#include "common/render/rasterise.h"

#include <gtest/gtest.h>
#include <cmath>
#include <numbers>

namespace gyre {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

// A trunk with a round top on two legs, 1.7 m tall, in the middle of the world.
constexpr double trunk_radius = 0.14, hip = 0.8, neck = 1.56;
constexpr double leg_radius = 0.07, leg_offset = 0.12;

struct Circle {
  Vector2d centre;  // x, z
  double radius;
};

std::vector<Circle> section_at(double y) {
  if (y >= hip)
    return {{{0, 0}, std::sqrt(std::max(0.0, trunk_radius * trunk_radius - std::pow(std::max(0.0, y - neck), 2)))}};
  return {{{leg_offset, 0}, leg_radius}, {{-leg_offset, 0}, leg_radius}};
}

// True when what stands at the height of `from` is met on the way to `to`, seen from above.
bool met(const Vector3d& from, const Vector3d& to) {
  const Vector2d a(from.x(), from.z());
  const Vector2d way = Vector2d(to.x(), to.z()) - a;
  for (const Circle& circle : section_at(from.y())) {
    const double along = std::clamp(way.dot(circle.centre - a) / way.squaredNorm(), 0.0, 1.0);
    if ((a + along * way - circle.centre).norm() < circle.radius - 1e-6) return true;
  }
  return false;
}

constexpr double spacing = 0.004;

struct Surface {
  std::vector<Vector3d> points, normals;
};

Surface figure() {
  Surface surface;
  for (double y = 0.002; y < neck; y += spacing) {
    for (const Circle& circle : section_at(y)) {
      const int around = static_cast<int>(2 * pi * circle.radius / spacing);
      for (int i = 0; i < around; ++i) {
        const Vector3d normal(std::sin(2 * pi * i / around), 0, std::cos(2 * pi * i / around));
        surface.points.push_back(Vector3d(circle.centre.x(), y, circle.centre.y()) + circle.radius * normal);
        surface.normals.push_back(normal);
      }
    }
  }
  for (double elevation = 0; elevation < 0.5 * pi; elevation += spacing / trunk_radius) {
    const int around = std::max(1, static_cast<int>(2 * pi * trunk_radius * std::cos(elevation) / spacing));
    for (int i = 0; i < around; ++i) {
      const double azimuth = 2 * pi * i / around;
      const Vector3d normal(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                            std::cos(elevation) * std::cos(azimuth));
      surface.points.push_back(Vector3d(0, neck, 0) + trunk_radius * normal);
      surface.normals.push_back(normal);
    }
  }
  return surface;
}

StereoView view_from(double azimuth, double distance, double height) {
  StereoView view;
  view.camera = Camera::from_fov(720, 1280, 60 * degree);
  view.cam_from_world =
      look_at(Vector3d(distance * std::sin(azimuth), height, distance * std::cos(azimuth)), Vector3d(0, 0.9, 0));
  return view;
}

// Views on a ring every ten degrees, from azimuth 0 to `last`, in degrees.
std::vector<StereoView> ring(int last) {
  std::vector<StereoView> views;
  for (int azimuth = 0; azimuth <= last; azimuth += 10) views.push_back(view_from(azimuth * degree, 2.4, 1.0));
  return views;
}

std::vector<StereoView> all_around() {
  std::vector<StereoView> views = ring(350);
  for (int i = 0; i < 8; ++i) views.push_back(view_from(i * pi / 4, 1.2, 2.6));
  return views;
}

// What of the figure three views see less than 70 degrees from square, without the points that `removed` names.
Coverage coverage_of(
    const std::vector<StereoView>& views, const std::function<bool(const Vector3d&, const Vector3d&)>& removed =
                                              [](const Vector3d&, const Vector3d&) { return false; }) {
  std::vector<Vector3d> eyes;
  for (const StereoView& view : views) eyes.push_back(centre_of(view.cam_from_world));
  const Surface surface = figure();
  PointCloud cloud;
  PointViews seen_by;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Vector3d& point = surface.points[i];
    const Vector3d& normal = surface.normals[i];
    if (removed(point, normal)) continue;
    std::vector<std::uint16_t> seeing;
    for (std::size_t v = 0; v < eyes.size(); ++v) {
      const Vector3d direction = (eyes[v] - point).normalized();
      // Only a leg can hide what faces a view: the other leg.
      if (normal.dot(direction) > std::cos(70 * degree) && !(point.y() < hip && met(point, eyes[v])))
        seeing.push_back(static_cast<std::uint16_t>(v));
    }
    if (seeing.size() < 3) continue;
    cloud.points.push_back(point.cast<float>());
    cloud.normals.push_back(normal.cast<float>());
    cloud.deviation.push_back(normal.x() > 0 ? 0.002F : 0.001F);
    seen_by.view.insert(seen_by.view.end(), seeing.begin(), seeing.end());
    seen_by.first.push_back(static_cast<std::uint32_t>(seen_by.view.size()));
  }
  const auto sight = [&](const Vector3d& x) {
    SightCount count;
    for (const Vector3d& eye : eyes) ++(met(x, eye) ? count.blocked : count.through);
    return count;
  };
  const SubjectRegion region{Vector3d(-0.5, 0, -0.5), Vector3d(0.5, 1.9, 0.5)};
  return measure_coverage(cloud, seen_by, views, region, sight, {.spacing = spacing});
}

// "band/sector" and how, of all holes.
std::vector<std::string> holes_of(const Coverage& coverage) {
  std::vector<std::string> holes;
  const nlohmann::json json = to_json(coverage);
  for (const auto& hole : json.at("holes")) {
    const std::string place = hole.contains("crown") ? "crown"
                                                     : std::to_string(hole.at("band").get<int>()) + "/" +
                                                           std::to_string(hole.at("sector").get<int>());
    holes.push_back(place + " " + hole.at("side").get<std::string>() + " " + hole.at("kind").get<std::string>());
  }
  return holes;
}

using Strings = std::vector<std::string>;

TEST(Coverage, AWholeFigureHasNoHolesAndTheSpaceBetweenItsLegsIsNone) {
  const Coverage coverage = coverage_of(all_around());
  EXPECT_EQ(holes_of(coverage), Strings());
  EXPECT_NEAR(coverage.height, 1.7, 0.003);
  EXPECT_EQ(coverage.cell(1, 0).points, 0);  // between the legs
  EXPECT_EQ(coverage.cell(1, 0).views, 0);
  const double band = 0.17;
  for (int sector = 0; sector < 12; ++sector) {
    const CoverageCell& cell = coverage.cell(6, sector);
    EXPECT_NEAR(cell.area, 2 * pi * trunk_radius * band / 12, 0.2 * cell.area);
    EXPECT_LT(cell.outer_missing + cell.inner_missing, 0.2);
    // Seven views each way from square, some more at the sector's borders, and those from above.
    EXPECT_GE(cell.views, 13);
    EXPECT_LE(cell.views, 22);
    EXPECT_LT(cell.best_angle, 5 * degree);
  }
  EXPECT_NEAR(coverage.cell(6, 3).median_deviation, 0.002, 1e-6);  // +X
  EXPECT_NEAR(coverage.cell(6, 9).median_deviation, 0.001, 1e-6);
  EXPECT_GT(coverage.crown.points, 1000);
  EXPECT_LT(coverage.crown.outer_missing, 0.2);
}

TEST(Coverage, WhatWasFilmedAndNotMatchedIsAHole) {
  // The outside of the left leg, knee to thigh: its other side in the same wedge stays.
  const auto outside = [](const Vector3d& p, const Vector3d& normal) {
    return p.y() > 0.51 && p.y() < 0.68 && std::abs(std::atan2(p.z(), p.x())) < 15 * degree && normal.x() > 0;
  };
  EXPECT_EQ(holes_of(coverage_of(all_around(), outside)), Strings{"3/3 outer not matched"});
  const auto inside = [](const Vector3d& p, const Vector3d& normal) {
    return p.y() > 0.51 && p.y() < 0.68 && std::abs(std::atan2(p.z(), p.x())) < 15 * degree && normal.x() < 0;
  };
  const Coverage inner = coverage_of(all_around(), inside);
  ASSERT_EQ(holes_of(inner).size(), 1U);
  EXPECT_TRUE(holes_of(inner)[0].starts_with("3/3 inner")) << holes_of(inner)[0];
  const auto both = [](const Vector3d& p, const Vector3d&) {
    return p.y() > 0.51 && p.y() < 0.68 && std::abs(std::atan2(p.z(), p.x())) < 15 * degree;
  };
  EXPECT_EQ(holes_of(coverage_of(all_around(), both)), Strings{"3/3 outer not matched"});
  const auto chest = [](const Vector3d& p, const Vector3d&) {
    return p.y() > 1.19 && p.y() < 1.36 && std::abs(std::atan2(p.x(), p.z())) < 15 * degree;
  };
  EXPECT_EQ(holes_of(coverage_of(all_around(), chest)), Strings{"7/0 outer not matched"});
}

TEST(Coverage, ALegThatDoesNotReachTheFloorIsAHole) {
  const auto foot = [](const Vector3d& p, const Vector3d&) { return p.y() < 0.17 && p.x() < 0; };
  const Strings holes = holes_of(coverage_of(all_around(), foot));
  EXPECT_FALSE(holes.empty());
  for (const std::string& hole : holes) {
    // The right leg is where azimuths are from 225 to 315 degrees.
    EXPECT_TRUE(hole.starts_with("0/8") || hole.starts_with("0/9") || hole.starts_with("0/10")) << hole;
  }
}

TEST(Coverage, LegsOfWhichNothingWasMatchedAreMissingAndWhatIsBetweenThemIsNot) {
  const auto legs = [](const Vector3d& p, const Vector3d&) { return p.y() < hip; };
  const Coverage coverage = coverage_of(all_around(), legs);
  for (int band = 0; band < 4; ++band) {
    for (const int sector : {3, 9}) EXPECT_EQ(coverage.cell(band, sector).hole, HoleKind::not_matched) << band;
    for (const int sector : {0, 6}) EXPECT_EQ(coverage.cell(band, sector).hole, HoleKind::none) << band;
  }
}

TEST(Coverage, ARingDoesNotSeeTheCrown) {
  const Coverage coverage = coverage_of(ring(350));
  EXPECT_EQ(holes_of(coverage), Strings{"crown outer not filmed"});
  // Views every ten degrees up to 70 from square.
  EXPECT_NEAR(coverage.cell(6, 0).median_angle, 35 * degree, 3 * degree);
}

TEST(Coverage, ACaptureOf270DegreesSeesTheRestByFewerAndSlanted) {
  const Coverage coverage = coverage_of(ring(270));
  EXPECT_EQ(holes_of(coverage), Strings{"crown outer not filmed"});
  // The middle of what was left out is at 315 degrees, between the sectors of 300 and 330, and 45 degrees from either
  // end of the walk.
  for (const int sector : {10, 11}) {
    EXPECT_LE(coverage.cell(6, sector).views, 10);
    EXPECT_NEAR(coverage.cell(6, sector).best_angle, 15 * degree, 3 * degree);
    EXPECT_GT(coverage.cell(6, sector).median_angle, 45 * degree);
  }
  EXPECT_GE(coverage.cell(6, 4).views, 13);
  EXPECT_LT(coverage.cell(6, 4).best_angle, 5 * degree);
}

TEST(Coverage, TheBackOfAHalfCaptureWasNotFilmed) {
  // From 0 to 150 degrees: what faces 255 degrees is 105 from either end.
  const Coverage coverage = coverage_of(ring(150));
  for (int band = 5; band < 9; ++band) {
    for (int sector = 0; sector < 12; ++sector) {
      const bool lost = sector == 8 || sector == 9;  // 225 to 285 degrees
      const bool border = sector == 7 || sector == 10;
      const HoleKind kind = coverage.cell(band, sector).hole;
      if (border) continue;
      EXPECT_EQ(kind, lost ? HoleKind::not_filmed : HoleKind::none) << band << "/" << sector;
    }
  }
}

TEST(Coverage, AnEmptyCloudHasEmptyCells) {
  const Coverage coverage = measure_coverage({}, {}, {}, {}, [](const Vector3d&) { return SightCount{}; }, {});
  EXPECT_EQ(coverage.cells.size(), 120U);
  EXPECT_EQ(summary_of(coverage), (nlohmann::json{{"holes", 0}, {"cells_with_surface", 0}}));
}

TEST(Coverage, IsWrittenWithUnits) {
  const nlohmann::json json = to_json(coverage_of(all_around()));
  EXPECT_EQ(json.at("cells").size(), 120U);
  const nlohmann::json& cell = json.at("cells").at(6 * 12 + 3);
  EXPECT_EQ(cell.at("band"), 6);
  EXPECT_EQ(cell.at("sector"), 3);
  EXPECT_EQ(cell.at("azimuth_deg"), 90.0);
  EXPECT_NEAR(cell.at("from_m").get<double>(), 1.02, 0.003);
  EXPECT_NEAR(cell.at("median_std_mm").get<double>(), 2.0, 1e-3);
  EXPECT_NEAR(cell.at("median_angle_deg").get<double>(), 40.0, 6.0);
  const nlohmann::json& space = json.at("cells").at(1 * 12);
  EXPECT_TRUE(space.at("median_std_mm").is_null());
  EXPECT_TRUE(space.at("best_angle_deg").is_null());
}

}  // namespace
}  // namespace gyre
