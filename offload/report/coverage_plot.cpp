// SPDX-License-Identifier: Apache-2.0
#include "offload/report/coverage_plot.h"

#include "offload/report/json_fields.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace gyre {

namespace {

using nlohmann::json;

enum class Hole { none, not_filmed, not_matched };

struct Cell {
  int points = 0, views = 0;
  double angle_deg = 0, std_mm = 0;
  Hole hole = Hole::none;
  bool inner = false;  // the hole is of what faces the axis
};

// coverage.json with the columns as a person sees them: from the back over the subject's right, its front and its left
// to the back again.
struct Unrolled {
  int bands = 0, sectors = 0;
  double height = 0;            // metres
  bool facing_known = false;    // else `azimuth` is that of the world
  std::vector<double> azimuth;  // degrees of each column's middle from the front to the subject's left, (-180, 180]
  std::vector<Cell> cells;      // band by band from the floor, columns in the order of `azimuth`
  Cell crown;

  const Cell& at(int band, int column) const { return cells[static_cast<std::size_t>(band) * sectors + column]; }
};

// A whole number of at most a million; a file may hold anything.
int count_at(const json& j, const char* pointer) {
  return static_cast<int>(std::clamp(number_at(j, pointer, 0), 0.0, 1e6));
}

Cell cell_of(const json& j) {
  return {count_at(j, "/points"), count_at(j, "/views"), number_at(j, "/median_angle_deg", 0),
          number_at(j, "/median_std_mm", 0)};
}

void mark_hole(Cell& cell, const json& hole) {
  cell.hole = text_at(hole, "/kind") == "not filmed" ? Hole::not_filmed : Hole::not_matched;
  cell.inner = text_at(hole, "/side") == "inner";
}

std::optional<Unrolled> unroll(const ReportFacts& facts) {
  const json& j = facts.coverage;
  Unrolled grid;
  grid.bands = count_at(j, "/bands");
  grid.sectors = count_at(j, "/sectors");
  grid.height = number_at(j, "/height_m", 0);
  if (grid.bands < 1 || grid.bands > 100 || grid.sectors < 3 || grid.sectors > 100 || !(grid.height > 0)) return {};
  const auto count = static_cast<std::size_t>(grid.bands) * static_cast<std::size_t>(grid.sectors);
  if (!j.contains("cells") || !j["cells"].is_array() || j["cells"].size() != count) return {};
  grid.facing_known = facts.fit.is_object() && facts.fit.contains("yaw_deg");

  std::vector<std::pair<double, int>> columns;  // azimuth, sector
  const double facing = facts.facing() * 180 / M_PI;
  for (int s = 0; s < grid.sectors; ++s) {
    double azimuth = std::remainder(s * 360.0 / grid.sectors - facing, 360.0);
    if (azimuth <= -180) azimuth += 360;
    columns.emplace_back(azimuth, s);
  }
  std::sort(columns.begin(), columns.end());
  std::vector<int> column_of(columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c) {
    grid.azimuth.push_back(columns[c].first);
    column_of[static_cast<std::size_t>(columns[c].second)] = static_cast<int>(c);
  }
  grid.cells.resize(count);
  const auto place = [&](int band, int sector) -> Cell& {
    return grid.cells[static_cast<std::size_t>(band) * grid.sectors + column_of[static_cast<std::size_t>(sector)]];
  };
  for (std::size_t i = 0; i < count; ++i)
    place(static_cast<int>(i) / grid.sectors, static_cast<int>(i) % grid.sectors) = cell_of(j["cells"][i]);
  if (j.contains("crown")) grid.crown = cell_of(j["crown"]);
  if (!j.contains("holes") || !j["holes"].is_array()) return grid;
  for (const json& hole : j["holes"]) {
    if (flag_at(hole, "/crown")) {
      mark_hole(grid.crown, hole);
      continue;
    }
    const double band = number_at(hole, "/band", -1), sector = number_at(hole, "/sector", -1);
    if (!(band >= 0 && band < grid.bands && sector >= 0 && sector < grid.sectors)) continue;
    mark_hole(place(static_cast<int>(band), static_cast<int>(sector)), hole);
  }
  return grid;
}

// Part of a standing person at a share of its height.
const char* part_at(double share) {
  constexpr std::array<std::pair<double, const char*>, 9> parts = {{{0.1, "foot"},
                                                                    {0.2, "shin"},
                                                                    {0.3, "knee"},
                                                                    {0.5, "thigh"},
                                                                    {0.6, "hip"},
                                                                    {0.7, "waist"},
                                                                    {0.8, "chest"},
                                                                    {0.9, "shoulder"},
                                                                    {2.0, "head"}}};
  return std::find_if(parts.begin(), parts.end(), [&](const auto& part) { return share < part.first; })->second;
}

std::string part_of_band(const Unrolled& grid, int band) {
  return part_at((band + 0.5) / grid.bands);
}

// Nearest of eight directions; azimuth in degrees towards the subject's left.
std::string side_at(const Unrolled& grid, double azimuth) {
  if (!grid.facing_known) return fmt::format("the side at {:.0f}\u00b0", std::fmod(azimuth + 360, 360));
  constexpr std::array<const char*, 8> sides = {"front", "front left", "left side",  "back left",
                                                "back",  "back right", "right side", "front right"};
  return sides[static_cast<std::size_t>(std::lround((azimuth + 360) / 45)) % 8];
}

// Connected cells with the same kind of hole.
struct Region {
  std::vector<std::pair<int, int>> cells;  // band, column
};

std::vector<Region> regions_of(const Unrolled& grid) {
  std::vector<char> done(grid.cells.size(), 0);
  std::vector<Region> regions;
  for (int start = 0; start < static_cast<int>(grid.cells.size()); ++start) {
    const Cell& first = grid.cells[static_cast<std::size_t>(start)];
    if (first.hole == Hole::none || done[static_cast<std::size_t>(start)] != 0) continue;
    Region region;
    const auto visit = [&](int band, int column) {
      if (band < 0 || band >= grid.bands) return;
      column = (column + grid.sectors) % grid.sectors;  // the surface closes at the back
      const Cell& cell = grid.at(band, column);
      char& seen = done[static_cast<std::size_t>(band) * grid.sectors + column];
      if (seen != 0 || cell.hole != first.hole || cell.inner != first.inner) return;
      seen = 1;
      region.cells.emplace_back(band, column);
    };
    visit(start / grid.sectors, start % grid.sectors);
    for (std::size_t next = 0; next < region.cells.size(); ++next) {
      const auto [band, column] = region.cells[next];
      visit(band - 1, column);
      visit(band + 1, column);
      visit(band, column - 1);
      visit(band, column + 1);
    }
    regions.push_back(std::move(region));
  }
  std::stable_sort(regions.begin(), regions.end(),
                   [](const Region& a, const Region& b) { return a.cells.size() > b.cells.size(); });
  return regions;
}

// "left side", "front left to back left", "all around".
std::string sides_of(const Unrolled& grid, const Region& region) {
  std::vector<char> taken(static_cast<std::size_t>(grid.sectors), 0);
  for (const auto& [band, column] : region.cells) taken[static_cast<std::size_t>(column)] = 1;
  const auto count = std::count(taken.begin(), taken.end(), 1);
  if (count > 3 * grid.sectors / 4) return "all around";
  // The run of columns begins where the one before it is free; a region is connected, so there is one run.
  int begin = 0;
  while (taken[static_cast<std::size_t>(begin)] == 0 ||
         taken[static_cast<std::size_t>((begin + grid.sectors - 1) % grid.sectors)] != 0)
    ++begin;
  const auto side = [&](std::ptrdiff_t step) {
    return side_at(grid, grid.azimuth[static_cast<std::size_t>((begin + step) % grid.sectors)]);
  };
  const std::string first = side(0), last = side(count - 1);
  return first == last ? first : first + " to " + last;
}

std::string heights_of(const Unrolled& grid, const Region& region) {
  const auto [low, high] = std::minmax_element(region.cells.begin(), region.cells.end());
  const std::string bottom = part_of_band(grid, low->first), top = part_of_band(grid, high->first);
  return (bottom == top ? bottom : bottom + " to " + top) + " height";
}

std::string sentence(std::string place, const Cell& cell) {
  place[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(place[0])));
  return place + ": hardly seen" +
         (cell.hole == Hole::not_filmed ? "; no picture looks at it squarely."
                                        : ", though pictures look at it (dark, shiny or plain?).");
}

// Steps of the number of views and their colours; a point needs three views.
constexpr std::array<std::pair<int, const char*>, 5> steps = {
    {{1, "#e3ecf4"}, {3, "#bcd3e6"}, {6, "#8bb3d1"}, {10, "#5890b8"}, {15, "#2f6690"}}};

std::string colour_of(int views) {
  const char* colour = "#fff";
  for (const auto& [least, step] : steps)
    if (views >= least) colour = step;
  return colour;
}

std::string cell_svg(const Cell& cell, double x, double y, double width, double height, const std::string& name) {
  std::string svg = fmt::format("<g><title>{}: ", name);
  svg += cell.points == 0 ? std::string("no surface")
                          : fmt::format("{} views, median angle {:.0f}\u00b0, standard deviation {:.1f} mm", cell.views,
                                        cell.angle_deg, cell.std_mm);
  if (cell.hole != Hole::none) svg += cell.hole == Hole::not_filmed ? "; hole, not filmed" : "; hole, not matched";
  svg += fmt::format(
      "</title><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" class=\"{}\"/>", x + 1,
      y + 1, width - 2, height - 2, colour_of(cell.views), cell.points == 0 ? "grid" : "cell");
  if (cell.points > 0)
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" style=\"fill:{}\">{}</text>",
                       x + width / 2, y + height / 2 + 4, cell.views >= 10 ? "#fff" : "#1d2430", cell.views);
  // The diagonal would hide the number.
  if (cell.hole != Hole::none)
    svg += fmt::format("<path d=\"M{0:.1f} {1:.1f}h{2:.1f}v{3:.1f}h-{2:.1f}z{4}\" class=\"hole\"/>", x + 2.5, y + 2.5,
                       width - 5, height - 5,
                       cell.points == 0 ? fmt::format("m0 {1:.1f}l{0:.1f} -{1:.1f}", width - 5, height - 5) : "");
  return svg + "</g>";
}

}  // namespace

std::string coverage_grid(const ReportFacts& facts) {
  const std::optional<Unrolled> grid = unroll(facts);
  if (!grid) return {};
  constexpr double left = 70, top = 22, width = 44, height = 22;
  const double right = left + width * grid->sectors, bottom = top + height * (grid->bands + 1);
  std::string svg =
      fmt::format("<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"Views of each side at each height\">",
                  right + 56, bottom + 40);
  const double middle = 0.5 * (left + right);
  svg += fmt::format("<text x=\"4\" y=\"{:.1f}\">crown</text>", top + height / 2 + 4);
  svg += cell_svg(grid->crown, middle - 2 * width, top, 4 * width, height, "crown");
  for (int row = 0; row < grid->bands; ++row) {
    const int band = grid->bands - 1 - row;
    const double y = top + height * (row + 1);
    svg += fmt::format("<text x=\"4\" y=\"{:.1f}\">{}</text><text x=\"{:.1f}\" y=\"{:.1f}\">{:.2f} m</text>",
                       y + height / 2 + 4, part_of_band(*grid, band), right + 8, y + height / 2 + 4,
                       (band + 0.5) * grid->height / grid->bands);
    for (int column = 0; column < grid->sectors; ++column)
      svg += cell_svg(grid->at(band, column), left + width * column, y, width, height,
                      side_at(*grid, grid->azimuth[static_cast<std::size_t>(column)]) + ", " +
                          part_of_band(*grid, band) + " height");
  }
  // Names of the sides where they are; the first column's middle is half a cell from the left.
  constexpr std::array<std::pair<double, const char*>, 5> names = {
      {{-180, "back"}, {-90, "its right"}, {0, "front"}, {90, "its left"}, {180, "back"}}};
  for (const auto& [azimuth, name] : names) {
    const double x = left + width * (0.5 + (azimuth - grid->azimuth.front()) * grid->sectors / 360.0);
    if (x < left || x > right) continue;
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", x, bottom + 14,
                       grid->facing_known ? name : fmt::format("{:.0f}\u00b0", std::fmod(azimuth + 360, 360)));
  }
  double x = left;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::string label = i + 1 < steps.size()
                                  ? fmt::format("{} to {} views", steps[i].first, steps[i + 1].first - 1)
                                  : fmt::format("{} or more", steps[i].first);
    svg += fmt::format(
        "<rect x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"12\" height=\"10\" fill=\"{2}\"/><text x=\"{3:.1f}\" "
        "y=\"{4:.1f}\">{5}</text>",
        x, bottom + 24, steps[i].second, x + 17, bottom + 33, label);
    x += 104;
  }
  svg += fmt::format(
      "<path d=\"M{0:.1f} {1:.1f}h12v10h-12z\" class=\"hole\"/><text x=\"{2:.1f}\" "
      "y=\"{3:.1f}\">hole</text>",
      x, bottom + 24, x + 17, bottom + 33);
  return svg + "</svg>";
}

std::vector<std::string> hole_sentences(const ReportFacts& facts) {
  const std::optional<Unrolled> grid = unroll(facts);
  if (!grid) return {};
  std::vector<std::string> sentences;
  if (grid->crown.hole != Hole::none) sentences.push_back(sentence("the crown", grid->crown));
  for (const Region& region : regions_of(*grid)) {
    const Cell& cell = grid->at(region.cells.front().first, region.cells.front().second);
    sentences.push_back(sentence(
        sides_of(*grid, region) + ", " + heights_of(*grid, region) + (cell.inner ? ", what faces inwards" : ""), cell));
  }
  return sentences;
}

}  // namespace gyre
