// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/hand_paint.h"

#include "common/geometry/quantile.h"
#include "offload/texture/colour.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace gyre {

namespace {

// CIELAB.
const Eigen::Vector3f skin(66, 14, 17);
const Eigen::Vector3f palm_more(3, 3, -1);
const Eigen::Vector3f knuckle_more(-3, 4, 1);
const Eigen::Vector3f nail_more(5, 2, -6);

constexpr std::size_t enough_texels = 400;

float step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return static_cast<float>(t * t * (3 - 2 * t));
}

// Waves of some millimetres that never repeat on a hand, in [-1, 1].
float mottle(const Eigen::Vector3d& p) {
  double sum = 0;
  for (const double waves : {700.0, 1900.0})  // radians a metre
    sum += std::sin(waves * p.x() + 1.3 * std::sin(0.7 * waves * p.y())) *
           std::sin(waves * p.y() + 1.7 * std::sin(0.6 * waves * p.z())) *
           std::sin(waves * p.z() + 1.1 * std::sin(0.8 * waves * p.x()));
  return static_cast<float>(0.5 * sum);
}

std::optional<Eigen::Vector3f> median_of(const std::vector<Eigen::Vector3f>& colours) {
  if (colours.size() < enough_texels) return std::nullopt;
  Eigen::Vector3f result;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    values.reserve(colours.size());
    for (const Eigen::Vector3f& colour : colours) values.push_back(colour[c]);
    result[c] = static_cast<float>(median(std::move(values)));
  }
  return result;
}

}  // namespace

HandPaint::HandPaint(const BodyTemplate& body)
    : body_(body),
      normals_(vertex_normals(body.mesh.vertices, body.mesh.triangles)),
      covered_(body.mesh.triangles.size(), 0),
      finger_of_(body.mesh.triangles.size(), -1) {
  palms_.fill(Eigen::Vector3d::Zero());
  shifts_.fill(Eigen::Vector3f::Zero());
  const std::vector<Eigen::Vector3d> joints = joint_positions(body, body.mesh.vertices);
  for (const char* side : {"left", "right"}) add_hand(side, joints);
}

int HandPaint::strongest_joint(int vertex) const {
  const SkinWeights& skin_weights = body_.skin[vertex];
  const auto strongest = std::max_element(skin_weights.weight.begin(), skin_weights.weight.end());
  return skin_weights.joint[static_cast<std::size_t>(strongest - skin_weights.weight.begin())];
}

HandPaint::Finger HandPaint::finger(const std::vector<int>& chain, const std::vector<Eigen::Vector3d>& joints,
                                    const Eigen::Vector3d& back) const {
  Finger made;
  for (const int joint : chain) made.knuckles.push_back(joints[joint]);
  const Eigen::Vector3d& last = made.knuckles.back();
  made.along = (last - made.knuckles[made.knuckles.size() - 2]).normalized();
  made.back = (back - back.dot(made.along) * made.along).normalized();
  for (std::size_t v = 0; v < body_.mesh.vertices.size(); ++v) {
    if (strongest_joint(static_cast<int>(v)) != chain.back()) continue;
    made.length = std::max(made.length, made.along.dot(body_.mesh.vertices[v] - last));
  }
  return made;
}

void HandPaint::add_hand(const std::string& side, const std::vector<Eigen::Vector3d>& joints) {
  const auto joint = [&](const std::string& name) { return body_.joint_index(side + name); };
  const int hand = joint("Hand"), index = joint("IndexProximal"), middle = joint("MiddleProximal"),
            little = joint("LittleProximal");
  if (hand < 0 || index < 0 || middle < 0 || little < 0 || body_.regions.empty()) return;
  const bool left = side == "left";
  const Eigen::Vector3d along = (joints[middle] - joints[hand]).normalized();
  const Eigen::Vector3d to_thumb = (joints[index] - joints[little]).normalized();
  Eigen::Vector3d& palm = palms_[left ? 0 : 1];
  palm = (left ? along.cross(to_thumb) : to_thumb.cross(along)).normalized();

  std::vector<int> finger_of_joint(body_.joints.size(), -1);
  for (const auto& [name, parts] :
       {std::pair<const char*, std::array<const char*, 3>>{"Thumb", {"Metacarpal", "Proximal", "Distal"}},
        {"Index", {"Proximal", "Intermediate", "Distal"}},
        {"Middle", {"Proximal", "Intermediate", "Distal"}},
        {"Ring", {"Proximal", "Intermediate", "Distal"}},
        {"Little", {"Proximal", "Intermediate", "Distal"}}}) {
    std::vector<int> chain;
    for (const char* part : parts) chain.push_back(joint(std::string(name) + part));
    if (std::find(chain.begin(), chain.end(), -1) != chain.end()) continue;
    const bool thumb = std::string_view(name) == "Thumb";
    // A thumb lies turned against the fingers by about half a right angle.
    const Eigen::Vector3d back = thumb ? Eigen::Vector3d(to_thumb - palm) : Eigen::Vector3d(-palm);
    for (const int j : chain) finger_of_joint[j] = static_cast<int>(fingers_.size());
    fingers_.push_back(finger(chain, joints, back));
  }

  const BodyRegion region = left ? BodyRegion::left_hand : BodyRegion::right_hand;
  for (std::size_t t = 0; t < covered_.size(); ++t) {
    const Eigen::Vector3i& c = body_.mesh.triangles[t];
    if (body_.regions[c[0]] != region || body_.regions[c[1]] != region || body_.regions[c[2]] != region) continue;
    covered_[t] = left ? 1 : 2;
    for (int k = 0; k < 3; ++k) finger_of_[t] = std::max(finger_of_[t], finger_of_joint[strongest_joint(c[k])]);
  }
}

HandPaint::Place HandPaint::place_at(int triangle, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  Place place;
  place.palm = step(-0.3, 0.4, normal.dot(palms_[covered_[triangle] - 1]));
  if (finger_of_[triangle] < 0) return place;
  const Finger& finger = fingers_[static_cast<std::size_t>(finger_of_[triangle])];
  const double back = normal.dot(finger.back);
  constexpr double fold = 0.006;  // metres
  for (const Eigen::Vector3d& knuckle : finger.knuckles)
    place.knuckle += static_cast<float>(std::exp(-std::pow(finger.along.dot(point - knuckle) / fold, 2)));
  place.knuckle = std::min(1.0F, place.knuckle) * step(-0.2, 0.6, back);
  const double out = finger.along.dot(point - finger.knuckles.back()) / finger.length;
  place.nail = step(0.42, 0.5, out) * (1 - step(0.93, 0.98, out)) * step(0.55, 0.7, back);
  return place;
}

Eigen::Vector3f HandPaint::colour(int triangle, const Eigen::Vector3d& weights) const {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    point += weights[k] * body_.mesh.vertices[body_.mesh.triangles[triangle][k]];
    normal += weights[k] * normals_[body_.mesh.triangles[triangle][k]];
  }
  const Place place = place_at(triangle, point, normal.normalized());
  const float mottled = mottle(point) * (1 - place.nail);
  const Eigen::Vector3f lab = skin + place.palm * palm_more + place.knuckle * knuckle_more + place.nail * nail_more +
                              mottled * Eigen::Vector3f(1.2F, 0.6F, 0.3F) + (1 - place.palm) * shifts_[0] +
                              place.palm * shifts_[1];
  return bgr_from_lab(lab);
}

std::string HandPaint::match(const Atlas& atlas, const Canvas& canvas) {
  std::vector<Eigen::Vector3f> backs, palms, forearms, face;
  const int lower_arms[2] = {body_.joint_index("leftLowerArm"), body_.joint_index("rightLowerArm")};
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int t = atlas.triangle[i];
    if (t < 0 || canvas.origin[i] != TexelOrigin::strict) continue;
    const Eigen::Vector3i& c = body_.mesh.triangles[t];
    std::vector<Eigen::Vector3f>* of = nullptr;
    if (covered_[t] != 0) {
      const Eigen::Vector3d weights = corner_weights(atlas, i);
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) normal += weights[k] * normals_[c[k]];
      const float palm = step(-0.3, 0.4, normal.normalized().dot(palms_[covered_[t] - 1]));
      if (palm < 0.1F) of = &backs;
      if (palm > 0.9F) of = &palms;
    } else if (body_.regions[c[0]] == BodyRegion::face) {
      of = &face;
    } else {
      const int joint = strongest_joint(c[0]);
      if (joint == lower_arms[0] || joint == lower_arms[1]) of = &forearms;
    }
    if (of != nullptr) of->push_back(lab_from_bgr(canvas.colour[i]));
  }
  const auto back = median_of(backs), palm = median_of(palms);
  if (back || palm) {
    if (back) shifts_[0] = *back - skin;
    if (palm) shifts_[1] = *palm - (skin + palm_more);
    if (!back) shifts_[0] = shifts_[1];
    if (!palm) shifts_[1] = shifts_[0];
    return "hands";
  }
  const auto forearm = median_of(forearms), cheek = median_of(face);
  if (!forearm && !cheek) return "";
  shifts_.fill((forearm ? *forearm : *cheek) - skin);
  return forearm ? "forearms" : "face";
}

}  // namespace gyre
