// SPDX-License-Identifier: Apache-2.0
#include "offload/report/camera_plot.h"

#include "offload/report/json_fields.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

struct Station {
  Eigen::Vector3d centre, forward;  // metres; subject facing +Z
  std::string name, colour;
};

std::vector<Station> stations(const ReportFacts& facts) {
  const Eigen::AngleAxisd facing_front(-facts.facing(), Eigen::Vector3d::UnitY());
  std::vector<Station> all;
  for (const auto& [id, image] : facts.model.images) {
    const auto name = parse_frame_name(image.name);
    if (!name) continue;
    const Pose& pose = image.cam_from_world;
    all.push_back({facing_front * centre_of(pose),
                   facing_front * (pose.rotation.conjugate() * Eigen::Vector3d::UnitZ()), image.name,
                   pass_colour(name->pass)});
  }
  return all;
}

// A number for a path: two decimals are a hundredth of a pixel.
std::string n(double value) {
  return fmt::format("{:.2f}", value);
}

std::string marker(double x, double y, double dx, double dy, const Station& station) {
  return fmt::format(
      "<g stroke=\"{0}\"><line x1=\"{1}\" y1=\"{2}\" x2=\"{3}\" y2=\"{4}\" stroke-opacity=\".45\"/>"
      "<circle cx=\"{1}\" cy=\"{2}\" r=\"3\" fill=\"{0}\" stroke=\"none\"><title>{5}</title></circle></g>",
      station.colour, n(x), n(y), n(x + dx), n(y + dy), station.name);
}

constexpr double look = 16;  // pixels of the line of sight

}  // namespace

std::string pass_colour(const std::string& pass) {
  return pass == "body" ? "#2f6690" : pass == "head" ? "#c8553d" : "#588157";
}

std::string cameras_from_above(const ReportFacts& facts) {
  const std::vector<Station> all = stations(facts);
  if (all.empty()) return {};
  double reach = 1.0;
  for (const Station& s : all) reach = std::max({reach, std::abs(s.centre.x()), std::abs(s.centre.z())});
  constexpr double size = 360, half = size / 2;
  const double scale = (half - 26) / reach;
  std::string svg =
      fmt::format("<svg viewBox=\"0 0 {0} {0}\" role=\"img\" aria-label=\"Camera positions from above\">", size);
  for (int metre = 1; metre <= static_cast<int>(reach); ++metre)
    svg += fmt::format("<circle cx=\"{0}\" cy=\"{0}\" r=\"{1}\" class=\"grid\"/><text x=\"{2}\" y=\"{3}\">{4} m</text>",
                       half, n(metre * scale), n(half + 4), n(half - metre * scale - 3), metre);
  // The subject: shoulders and the direction it faces.
  svg += fmt::format(
      "<ellipse cx=\"{0}\" cy=\"{0}\" rx=\"{1}\" ry=\"{2}\" class=\"subject\"/>"
      "<path d=\"M{0} {3}l-5 -7h10z\" class=\"subject\"/>",
      half, n(0.24 * scale), n(0.13 * scale), n(half + 0.13 * scale + 9));
  for (const Station& s : all) {
    const Eigen::Vector2d ahead = Eigen::Vector2d(s.forward.x(), s.forward.z()) * look;
    svg += marker(half + s.centre.x() * scale, half + s.centre.z() * scale, ahead.x(), ahead.y(), s);
  }
  return svg + "</svg>";
}

std::string cameras_from_side(const ReportFacts& facts) {
  const std::vector<Station> all = stations(facts);
  if (all.empty()) return {};
  const double stature = number_at(facts.scene, "/height_mm", 1700) / 1000;
  double far = 1.0, top = stature;
  for (const Station& s : all) {
    far = std::max(far, std::hypot(s.centre.x(), s.centre.z()));
    top = std::max(top, s.centre.y());
  }
  constexpr double width = 440, height = 360, left = 70, floor = height - 28;
  const double scale = std::min((width - left - 26) / far, (floor - 20) / top);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Camera positions from the side\">", width, height);
  for (int half_metre = 0; half_metre <= static_cast<int>(2 * top); ++half_metre) {
    const double y = floor - 0.5 * half_metre * scale;
    svg += fmt::format(
        "<line x1=\"36\" y1=\"{0}\" x2=\"{1}\" y2=\"{0}\" class=\"grid\"/><text x=\"4\" y=\"{2}\">{3:.1f} m</text>",
        n(y), width - 8, n(y + 4), 0.5 * half_metre);
  }
  // The subject as a pawn: head and body of its stature.
  const double head = 0.07 * stature * scale;
  svg += fmt::format(
      "<circle cx=\"{0}\" cy=\"{1}\" r=\"{2}\" class=\"subject\"/>"
      "<path d=\"M{3} {4}L{5} {6}H{7}L{8} {4}z\" class=\"subject\"/>",
      left, n(floor - stature * scale + head), n(head), n(left - 2 * head), n(floor), n(left - 0.9 * head),
      n(floor - stature * scale + 2.2 * head), n(left + 0.9 * head), n(left + 2 * head));
  for (const Station& s : all) {
    const double radius = std::hypot(s.centre.x(), s.centre.z());
    const Eigen::Vector2d outwards =
        radius > 1e-6 ? Eigen::Vector2d(s.centre.x(), s.centre.z()) / radius : Eigen::Vector2d(1, 0);
    const double ahead = outwards.dot(Eigen::Vector2d(s.forward.x(), s.forward.z()));
    svg += marker(left + radius * scale, floor - s.centre.y() * scale, ahead * look, -s.forward.y() * look, s);
  }
  return svg + "</svg>";
}

}  // namespace gyre
