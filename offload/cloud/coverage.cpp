// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/coverage.h"

#include "common/geometry/quantile.h"
#include "offload/cloud/cell_grid.h"
#include "offload/cloud/dense_cloud.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

namespace gyre {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180.0;
constexpr double least_radius = 0.015;  // metres; nearer to the axis the flux of a patch depends on its exact place
constexpr double crown_upright = 0.7;   // cosine to up from which a point of the topmost band is crown
constexpr double hole = 0.5;            // share of a wall
constexpr double filled = 0.5;          // share of a wall that is there
constexpr double empty = 0.15;
constexpr int longest_gap = 2;         // bands
constexpr int axis_samples = 8;        // a band
constexpr double seen_through = 0.1;   // share of the views that may err
constexpr int least_towards = 3;       // views a point needs
constexpr double usual_radius = 0.12;  // metres, where a band does not tell

// Nobody looks through the place; nothing when no view says anything about it.
std::optional<bool> solid(const SightCount& sight) {
  if (sight.through + sight.blocked == 0) return std::nullopt;
  return sight.through <= seen_through * (sight.through + sight.blocked);
}

// The wedges and the surface in each of them.
struct Grid {
  CoverageOptions options;
  Eigen::Vector2d axis;
  double band_height = 0;

  double sector_angle() const { return 2 * std::numbers::pi / options.sectors; }
  double radius(const Vector3d& x) const { return std::hypot(x.x() - axis.x(), x.z() - axis.y()); }
  int band_of(const Vector3d& x) const {
    return std::clamp(static_cast<int>(std::floor(x.y() / band_height)), 0, options.bands - 1);
  }
  int sector_of(const Vector3d& x) const {
    const double turns = std::atan2(x.x() - axis.x(), x.z() - axis.y()) / sector_angle();
    return (static_cast<int>(std::floor(turns + 0.5)) + options.sectors) % options.sectors;
  }
  std::size_t index(int band, int sector) const { return static_cast<std::size_t>(band) * options.sectors + sector; }
  std::size_t cell_of(const Vector3d& x) const { return index(band_of(x), sector_of(x)); }
  bool crown(const Vector3d& x, const Vector3d& normal) const {
    return band_of(x) == options.bands - 1 && normal.y() > crown_upright;
  }
  Vector3d outward(int sector) const {
    const double azimuth = sector * sector_angle();
    return {std::sin(azimuth), 0, std::cos(azimuth)};
  }
  Vector3d at(double r, int sector, double y) const { return r * outward(sector) + Vector3d(axis.x(), y, axis.y()); }
};

// Flux of r / |r|^2 through a wedge's surface, as a share of that of a full wall, and where its outward part lies.
struct Wall {
  double outward = 0;
  double inward = 0;
  double radius_sum = 0;  // weighted by the outward flux

  double radius() const { return radius_sum / outward; }
};

// The area each point stands for: that of a disc over the number of points on the same side of the surface in it.
std::vector<double> areas_of(const PointCloud& cloud, double radius) {
  const CellGrid grid(cloud.points, radius);
  const auto squared = static_cast<float>(radius * radius);
  std::vector<double> areas;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    int around = 0;
    for_neighbour_cells(grid.cell_of(cloud.points[i]), [&](const Cell& cell) {
      const std::ptrdiff_t found = grid.find(cell);
      if (found < 0) return;
      grid.for_points(static_cast<std::size_t>(found), [&](std::uint32_t j) {
        const bool near = (cloud.points[j] - cloud.points[i]).squaredNorm() <= squared;
        around += near && cloud.normals[j].dot(cloud.normals[i]) > 0 ? 1 : 0;
      });
    });
    areas.push_back(std::numbers::pi * radius * radius / std::max(around, 1));
  }
  return areas;
}

std::vector<Wall> walls_of(const PointCloud& cloud, const std::vector<double>& areas, const Grid& grid) {
  std::vector<Wall> walls(static_cast<std::size_t>(grid.options.bands) * grid.options.sectors);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d x = cloud.points[i].cast<double>();
    const Vector3d normal = cloud.normals[i].cast<double>();
    const double r = grid.radius(x);
    if (r < least_radius) continue;
    const double towards = (normal.x() * (x.x() - grid.axis.x()) + normal.z() * (x.z() - grid.axis.y())) / r;
    const double flux = areas[i] * towards / (r * grid.band_height * grid.sector_angle());
    Wall& wall = walls[grid.cell_of(x)];
    (flux > 0 ? wall.outward : wall.inward) += std::abs(flux);
    if (flux > 0) wall.radius_sum += flux * r;
  }
  return walls;
}

// Share of the axis that is inside the subject, in one band.
double axis_inside(const Grid& grid, int band, const std::vector<Wall>& walls,
                   const std::function<SightCount(const Vector3d&)>& sight) {
  int known = 0;
  int inside = 0;
  for (int i = 0; i < axis_samples; ++i) {
    const double y = (band + (i + 0.5) / axis_samples) * grid.band_height;
    const std::optional<bool> there = solid(sight(grid.at(0, 0, y)));
    known += there ? 1 : 0;
    inside += there.value_or(false) ? 1 : 0;
  }
  if (known > 0) return static_cast<double>(inside) / known;
  std::vector<double> fluxes;
  for (int s = 0; s < grid.options.sectors; ++s) {
    const Wall& wall = walls[grid.index(band, s)];
    fluxes.push_back(wall.outward - wall.inward);
  }
  return median(fluxes) >= filled ? 1 : 0;
}

// Distance of a wedge's outer surface from the axis: its own, or what the band's other wedges have.
double radius_at(const Grid& grid, const std::vector<Wall>& walls, int band, int sector) {
  const Wall& own = walls[grid.index(band, sector)];
  if (own.outward > empty) return own.radius();
  std::vector<double> others;
  for (int s = 0; s < grid.options.sectors; ++s) {
    const Wall& wall = walls[grid.index(band, s)];
    if (wall.outward > empty) others.push_back(wall.radius());
  }
  return others.empty() ? usual_radius : median(others);
}

// True for an empty wedge that has filled ones above and below (or the floor), when nobody looks through what joins
// them. Over more than longest_gap bands only where all other wedges of the band are empty as well: what is under a
// hand or between the legs is no gap.
bool missing_between(const Grid& grid, const std::vector<Wall>& walls, int band, int sector,
                     const std::function<SightCount(const Vector3d&)>& sight) {
  const auto outward = [&](int b) { return walls[grid.index(b, sector)].outward; };
  if (outward(band) >= empty) return false;
  int above = band;
  while (above < grid.options.bands && outward(above) < filled) ++above;
  int below = band;
  while (below >= 0 && outward(below) < filled) --below;
  if (above == grid.options.bands) return false;
  const auto row = walls.begin() + static_cast<std::ptrdiff_t>(grid.index(band, 0));
  const bool nothing = std::all_of(row, row + grid.options.sectors, [](const Wall& w) { return w.outward < empty; });
  if (above - below - 1 > longest_gap && !nothing) return false;
  const double top = walls[grid.index(above, sector)].radius();
  const double bottom = below >= 0 ? walls[grid.index(below, sector)].radius() : top;
  int looked_through = 0;
  for (const double height : {0.25, 0.5, 0.75}) {
    const double t = (band + height - below - 0.5) / (above - below);
    const Vector3d place = grid.at(bottom + t * (top - bottom), sector, (band + height) * grid.band_height);
    looked_through += solid(sight(place)).value_or(true) ? 0 : 1;
  }
  return looked_through < 2;
}

// Views that look at the place less than 60 degrees from square and have it in their picture.
int count_towards(std::span<const StereoView> views, const Vector3d& place, const Vector3d& normal) {
  return static_cast<int>(std::count_if(views.begin(), views.end(), [&](const StereoView& view) {
    const Vector3d to_eye = centre_of(view.cam_from_world) - place;
    if (normal.dot(to_eye) < 0.5 * to_eye.norm()) return false;
    const auto pixel = view.camera.project(view.cam_from_world * place);
    return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= view.camera.width &&
           pixel->y() <= view.camera.height;
  }));
}

// What the points of one cell say together.
class Statistics {
 public:
  explicit Statistics(std::size_t views) : seen_by_(views, 0) {}

  void add(const Vector3d& point, const Vector3d& normal, double deviation, std::span<const std::uint16_t> seen_by,
           const std::vector<Vector3d>& eyes) {
    deviations_.push_back(deviation);
    for (const std::uint16_t v : seen_by) {
      ++seen_by_[v];
      angles_.push_back(std::acos(std::clamp(normal.dot((eyes[v] - point).normalized()), -1.0, 1.0)));
    }
  }

  void write(CoverageCell& cell) {
    cell.points = static_cast<int>(deviations_.size());
    const double least = std::max(1.0, 0.1 * cell.points);
    cell.views = static_cast<int>(std::count_if(seen_by_.begin(), seen_by_.end(), [&](int n) { return n >= least; }));
    if (!deviations_.empty()) cell.median_deviation = median(deviations_);
    if (angles_.empty()) return;
    cell.best_angle = *std::min_element(angles_.begin(), angles_.end());
    cell.median_angle = median(angles_);
  }

 private:
  std::vector<int> seen_by_;  // points a view
  std::vector<double> angles_, deviations_;
};

void add_statistics(Coverage& coverage, const Grid& grid, const PointCloud& cloud, const PointViews& seen_by,
                    std::span<const StereoView> views) {
  std::vector<Vector3d> eyes;
  for (const StereoView& view : views) eyes.push_back(centre_of(view.cam_from_world));
  std::vector<Statistics> cells(coverage.cells.size() + 1, Statistics(views.size()));  // the last: the crown
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d x = cloud.points[i].cast<double>();
    const Vector3d normal = cloud.normals[i].cast<double>();
    const std::size_t cell = grid.crown(x, normal) ? coverage.cells.size() : grid.cell_of(x);
    cells[cell].add(x, normal, cloud.deviation[i], seen_by.of(i), eyes);
  }
  for (std::size_t c = 0; c < coverage.cells.size(); ++c) cells[c].write(coverage.cells[c]);
  cells.back().write(coverage.crown);
}

// Area of the convex hull (Andrew's monotone chain, IPL 1979).
double hull_area(std::vector<Eigen::Vector2d> points) {
  if (points.size() < 3) return 0;
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  double twice = 0;
  for (int side = 0; side < 2; ++side) {
    std::vector<Eigen::Vector2d> chain;
    for (const Eigen::Vector2d& p : points) {
      while (chain.size() > 1) {
        const Eigen::Vector2d a = chain.back() - chain[chain.size() - 2];
        const Eigen::Vector2d b = p - chain.back();
        if (a.x() * b.y() - a.y() * b.x() > 0) break;
        chain.pop_back();
      }
      chain.push_back(p);
    }
    for (std::size_t i = 1; i < chain.size(); ++i)
      twice += chain[i - 1].x() * chain[i].y() - chain[i].x() * chain[i - 1].y();
    std::reverse(points.begin(), points.end());
  }
  return 0.5 * twice;
}

HoleKind kind_of(int views_towards) {
  return views_towards < least_towards ? HoleKind::not_filmed : HoleKind::not_matched;
}

void measure_crown(Coverage& coverage, const Grid& grid, const PointCloud& cloud, const std::vector<double>& areas,
                   std::span<const StereoView> views) {
  const double from = (grid.options.bands - 1) * grid.band_height;
  std::vector<Eigen::Vector2d> section;
  Vector3d middle = Vector3d::Zero();
  double crown = 0;  // area as seen from above
  double rest = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d x = cloud.points[i].cast<double>();
    if (x.y() < from) continue;
    const Vector3d normal = cloud.normals[i].cast<double>();
    (grid.crown(x, normal) ? crown : rest) += areas[i] * normal.y();
    if (x.y() > from + 0.25 * grid.band_height) continue;
    section.emplace_back(x.x(), x.z());
    middle += x;
  }
  const double expected = hull_area(section) - rest;
  if (!(expected > 0)) return;
  middle /= static_cast<double>(section.size());
  coverage.crown.outer_missing = std::clamp(1 - crown / expected, 0.0, 1.0);
  coverage.crown.views_towards =
      count_towards(views, Vector3d(middle.x(), coverage.height, middle.z()), Vector3d::UnitY());
  if (coverage.crown.outer_missing > hole) coverage.crown.hole = kind_of(coverage.crown.views_towards);
}

nlohmann::json json_of(const CoverageCell& cell) {
  nlohmann::json json = {{"points", cell.points},
                         {"area_m2", cell.area},
                         {"views", cell.views},
                         {"views_towards", cell.views_towards},
                         {"best_angle_deg", nullptr},
                         {"median_angle_deg", nullptr},
                         {"median_std_mm", nullptr},
                         {"outer_missing", cell.outer_missing},
                         {"inner_missing", cell.inner_missing}};
  if (cell.points > 0) json["median_std_mm"] = 1000 * cell.median_deviation;
  if (cell.views > 0) {
    json["best_angle_deg"] = cell.best_angle / degree;
    json["median_angle_deg"] = cell.median_angle / degree;
  }
  return json;
}

void add_hole(nlohmann::json& holes, const CoverageCell& cell, nlohmann::json place) {
  if (cell.hole == HoleKind::none) return;
  place["kind"] = cell.hole == HoleKind::not_filmed ? "not filmed" : "not matched";
  place["side"] = cell.outer_missing >= cell.inner_missing ? "outer" : "inner";
  holes.push_back(std::move(place));
}

}  // namespace

Coverage measure_coverage(const PointCloud& cloud, const PointViews& seen_by, std::span<const StereoView> views,
                          const SubjectRegion& region, const std::function<SightCount(const Vector3d&)>& sight,
                          const CoverageOptions& options) {
  Coverage coverage;
  coverage.grid = options;
  coverage.axis = Eigen::Vector2d(region.centre().x(), region.centre().z());
  coverage.cells.resize(static_cast<std::size_t>(options.bands) * options.sectors);
  coverage.height = robust_height(cloud);
  if (!(coverage.height > 0)) return coverage;
  const Grid grid{options, coverage.axis, coverage.height / options.bands};

  add_statistics(coverage, grid, cloud, seen_by, views);
  const std::vector<double> areas = areas_of(cloud, 4 * options.spacing);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d x = cloud.points[i].cast<double>();
    const bool crown = grid.crown(x, cloud.normals[i].cast<double>());
    (crown ? coverage.crown : coverage.cells[grid.cell_of(x)]).area += areas[i];
  }
  const std::vector<Wall> walls = walls_of(cloud, areas, grid);
  for (int band = 0; band < options.bands; ++band) {
    const double inside = axis_inside(grid, band, walls, sight);
    for (int sector = 0; sector < options.sectors; ++sector) {
      CoverageCell& cell = coverage.cells[grid.index(band, sector)];
      const Wall& wall = walls[grid.index(band, sector)];
      const double missing = inside - (wall.outward - wall.inward);
      cell.outer_missing = std::clamp(missing, 0.0, 1.0);
      cell.inner_missing = std::clamp(-missing, 0.0, 1.0);
      if (missing_between(grid, walls, band, sector, sight)) cell.outer_missing = 1;
      const double r = radius_at(grid, walls, band, sector);
      cell.views_towards = count_towards(views, grid.at(r, sector, (band + 0.5) * grid.band_height),
                                         (cell.outer_missing >= cell.inner_missing ? 1 : -1) * grid.outward(sector));
      if (std::max(cell.outer_missing, cell.inner_missing) > hole) cell.hole = kind_of(cell.views_towards);
    }
  }
  measure_crown(coverage, grid, cloud, areas, views);
  return coverage;
}

nlohmann::json to_json(const Coverage& coverage) {
  const CoverageOptions& grid = coverage.grid;
  const double sector_deg = 360.0 / grid.sectors;
  const double band = coverage.height / grid.bands;
  nlohmann::json json = {{"axis_m", {coverage.axis.x(), coverage.axis.y()}},
                         {"height_m", coverage.height},
                         {"bands", grid.bands},
                         {"sectors", grid.sectors},
                         {"sector_deg", sector_deg},
                         {"band_m", band},
                         {"cells", nlohmann::json::array()},
                         {"crown", json_of(coverage.crown)},
                         {"holes", nlohmann::json::array()}};
  add_hole(json["holes"], coverage.crown, {{"crown", true}});
  for (int b = 0; b < grid.bands; ++b) {
    for (int s = 0; s < grid.sectors; ++s) {
      nlohmann::json cell = json_of(coverage.cell(b, s));
      cell["band"] = b;
      cell["sector"] = s;
      cell["azimuth_deg"] = s * sector_deg;
      cell["from_m"] = b * band;
      cell["to_m"] = (b + 1) * band;
      json["cells"].push_back(std::move(cell));
      add_hole(json["holes"], coverage.cell(b, s), {{"band", b}, {"sector", s}});
    }
  }
  return json;
}

nlohmann::json summary_of(const Coverage& coverage) {
  std::vector<double> views, angles, deviations;
  int holes = coverage.crown.hole == HoleKind::none ? 0 : 1;
  for (const CoverageCell& cell : coverage.cells) {
    holes += cell.hole == HoleKind::none ? 0 : 1;
    if (cell.views == 0) continue;
    views.push_back(cell.views);
    angles.push_back(cell.median_angle / degree);
    deviations.push_back(1000 * cell.median_deviation);
  }
  nlohmann::json summary = {{"holes", holes}, {"cells_with_surface", views.size()}};
  if (views.empty()) return summary;
  summary["median_views"] = median(views);
  summary["median_angle_deg"] = median(angles);
  summary["median_std_mm"] = median(deviations);
  return summary;
}

}  // namespace gyre
