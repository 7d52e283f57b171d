// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/inner_parts.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace gyre {

namespace {

// Encoded BGR.
const Eigen::Vector3f sclera(222, 226, 232);
const Eigen::Vector3f sclera_rim(150, 160, 200);
const Eigen::Vector3f iris_inner(60, 95, 130);
const Eigen::Vector3f iris_outer(35, 55, 80);
const Eigen::Vector3f pupil(12, 10, 10);
const Eigen::Vector3f teeth(205, 222, 230);
const Eigen::Vector3f tongue(105, 95, 180);
const Eigen::Vector3f mouth(60, 50, 120);
const Eigen::Vector3f socket_skin(95, 110, 150);

constexpr double degree = 0.017453292519943295;

float step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

Eigen::Vector3f mix(const Eigen::Vector3f& a, const Eigen::Vector3f& b, float t) {
  return (1 - t) * a + t * b;
}

Eigen::Vector3f moved(const Eigen::Vector3f& bgr, const Eigen::Vector3f& lab_shift) {
  if (lab_shift.isZero()) return bgr;
  return bgr_from_lab(lab_from_bgr(bgr) + lab_shift);
}

}  // namespace

InnerPaint::InnerPaint(const BodyTemplate& body)
    : body_(body),
      covered_(body.mesh.triangles.size(), 0),
      kind_(body.mesh.triangles.size(), Kind::none),
      eye_of_(body.mesh.triangles.size(), 0) {
  for (const TemplatePart& part : body.parts) {
    const auto is = [&](std::string_view name) { return part.name == name; };
    Kind kind = Kind::none;
    if (is("leftEye") || is("rightEye")) kind = Kind::eye;
    if (is("upperTeeth") || is("lowerTeeth")) kind = Kind::teeth;
    if (is("tongue")) kind = Kind::tongue;
    if (kind == Kind::none) continue;
    std::fill_n(kind_.begin() + part.first_triangle, part.triangle_count, kind);
    if (kind != Kind::eye) continue;
    Eigen::Vector3d low = body.mesh.vertices[part.first_vertex];
    Eigen::Vector3d high = low;
    for (int v = part.first_vertex; v < part.first_vertex + part.vertex_count; ++v) {
      low = low.cwiseMin(body.mesh.vertices[v]);
      high = high.cwiseMax(body.mesh.vertices[v]);
    }
    std::fill_n(eye_of_.begin() + part.first_triangle, part.triangle_count, static_cast<std::uint8_t>(eyes_.size()));
    eyes_.push_back({0.5 * (low + high), 0.25 * ((high - low).x() + (high - low).y())});
  }
  cover_cavities();
  std::transform(kind_.begin(), kind_.end(), covered_.begin(),
                 [](Kind k) { return static_cast<std::uint8_t>(k != Kind::none); });
}

void InnerPaint::cover_cavities() {
  const TemplatePart* skin = body_.part("body");
  if (skin == nullptr || body_.regions.empty()) return;
  constexpr double socket_reach = 2.0;  // radii of the eye
  for (int t = skin->first_triangle; t < skin->first_triangle + skin->triangle_count; ++t) {
    const Eigen::Vector3i& corners = body_.mesh.triangles[t];
    const auto is_inner = [&](int v) { return body_.regions[v] == BodyRegion::inner; };
    if (!is_inner(corners[0]) || !is_inner(corners[1]) || !is_inner(corners[2])) continue;
    const Eigen::Vector3d& at = body_.mesh.vertices[corners[0]];
    const bool socket = std::any_of(eyes_.begin(), eyes_.end(), [&](const Eye& eye) {
      return (at - eye.centre).norm() < socket_reach * eye.radius;
    });
    kind_[t] = socket ? Kind::socket : Kind::mouth;
  }
}

void InnerPaint::match(const EyeColours& person) {
  iris_shift_ = lab_from_bgr(person.iris) - lab_from_bgr(mix(iris_inner, iris_outer, 0.5F));
  if (person.sclera) white_shift_ = lab_from_bgr(*person.sclera) - lab_from_bgr(sclera);
}

// The iris is a disc of 11.7 mm on a ball of 24 mm, facing +Z as the template's eyes do.
Eigen::Vector3f InnerPaint::eye_colour(const Eye& eye, const Eigen::Vector3d& point) const {
  const Eigen::Vector3d direction = (point - eye.centre).normalized();
  const double angle = std::acos(std::clamp(direction.z(), -1.0, 1.0)) / degree;
  const double around = std::atan2(direction.y(), direction.x());
  const float fibres = 0.08F * static_cast<float>(std::sin(23 * around) + std::sin(41 * around + 1.0));
  Eigen::Vector3f iris = mix(iris_inner, iris_outer, step(14, 29, angle)) * (1.0F + fibres);
  iris = mix(pupil, moved(iris, iris_shift_), step(10, 12, angle));
  const Eigen::Vector3f white = moved(mix(sclera, sclera_rim, step(50, 95, angle)), white_shift_);
  return mix(iris, white, step(28, 31, angle));
}

Eigen::Vector3f InnerPaint::neutral_colour(int triangle) const {
  switch (kind_[triangle]) {
    case Kind::teeth:
      return teeth;
    case Kind::tongue:
      return tongue;
    case Kind::socket:
      return socket_skin;
    case Kind::eye:
    case Kind::mouth:
    case Kind::none:
      break;
  }
  return mouth;
}

Eigen::Vector3f InnerPaint::colour(int triangle, const Eigen::Vector3d& weights) const {
  if (kind_[triangle] != Kind::eye) return moved(neutral_colour(triangle), 0.5F * white_shift_);
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) point += weights[k] * body_.mesh.vertices[body_.mesh.triangles[triangle][k]];
  return eye_colour(eyes_[eye_of_[triangle]], point);
}

}  // namespace gyre
