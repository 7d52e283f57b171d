// SPDX-License-Identifier: Apache-2.0
// Which side of the subject was seen at which height, by how many views and how squarely, and where it was not.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/cloud/free_space.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace gyre {

enum class HoleKind {
  none,
  not_filmed,   // too few pictures look at the place to make points there
  not_matched,  // pictures look at it, and found nothing to match: dark, shiny or plain
};

// One wedge of one height band, or the crown.
struct CoverageCell {
  int points = 0;
  double area = 0;              // of the surface seen, square metres
  int views = 0;                // that see at least a tenth of the points
  int views_towards = 0;        // whose picture holds the place and that look at it less than 60 degrees from square
  double best_angle = 0;        // between a point's normal and the direction to a view that sees it, radians
  double median_angle = 0;      // of the same over all points and views
  double median_deviation = 0;  // of the points, metres
  double outer_missing = 0;     // in [0, 1]: outward surface that must exist and is not there, 1: a full wall
  double inner_missing = 0;     // the same of surface that faces the axis: insides of legs and arms
  HoleKind hole = HoleKind::none;
};

struct CoverageOptions {
  int bands = 10;    // of equal height, from the floor to the top of the cloud
  int sectors = 12;  // of equal angle about the vertical axis; the first is centred on +Z, the next ones lie towards +X
  double spacing = 0.002;  // metres between the cloud's points
};

struct Coverage {
  Eigen::Vector2d axis = Eigen::Vector2d::Zero();  // x and z, metres
  double height = 0;                               // of the cloud, metres
  CoverageOptions grid;
  std::vector<CoverageCell> cells;  // bands * sectors, band by band from the floor
  CoverageCell crown;               // what faces up in the topmost band; not in its cells

  const CoverageCell& cell(int band, int sector) const {
    return cells[static_cast<std::size_t>(band) * grid.sectors + sector];
  }
};

// What is missing follows from the surface being closed. The horizontal field r / |r|^2 about the axis has no sources
// but the axis, so that by the divergence theorem the surface in each wedge of a band lets through the same flux: the
// wedge's angle times the length of the axis inside the subject in that band (1 is a full wall; 0 where the axis runs
// between the legs, whose insides and outsides balance). Where less comes out than must, outward surface is missing;
// where more, surface that faces the axis. `sight` tells whether the axis is inside: nobody looks through it there.
// A wedge that is empty between filled ones above and below, or between a filled one and the floor, is missing too when
// nobody looks through the place. More than half a wall missing makes a hole. The same holds of the crown and the
// vertical field: seen from above it must fill the cross-section of the head that the surface around it leaves open.
//
// The cloud has normals and deviation; seen_by belongs to it and to `views`, of which only poses and
// cameras are used. An empty cloud gives empty cells.
Coverage measure_coverage(const PointCloud& cloud, const PointViews& seen_by, std::span<const StereoView> views,
                          const SubjectRegion& region, const std::function<SightCount(const Eigen::Vector3d&)>& sight,
                          const CoverageOptions& options);

// coverage.json: axis_m [x, z], height_m, bands, sectors, sector_deg, band_m, `cells`, `crown` and `holes`. A cell has
// band (0 at the floor), sector, azimuth_deg (of its middle, from +Z towards +X), from_m and to_m above the floor,
// points, area_m2, views, views_towards, best_angle_deg, median_angle_deg, median_std_mm, outer_missing, inner_missing
// (angles and deviation null without points). A hole has band and sector, or "crown": true, and `kind`, "not filmed" or
// "not matched", and `side`, "outer" or "inner".
nlohmann::json to_json(const Coverage& coverage);

// For the stage's facts: holes, cells_with_surface, and the medians over those cells of views, angle and deviation.
nlohmann::json summary_of(const Coverage& coverage);

}  // namespace gyre
