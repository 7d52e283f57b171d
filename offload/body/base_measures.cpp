// SPDX-License-Identifier: Apache-2.0
#include "offload/body/base_measures.h"

#include <cassert>

namespace gyre {
namespace {

// Vertices of hm08.
constexpr int crown = 881, navel = 4121, nipple = 8451, buttock = 10854, crotch = 4372, knee = 11223, heel = 12442;
constexpr int left_acromion = 8226, left_elbow = 10042, left_wrist = 10572;

// The source bone that moves a vertex most.
std::vector<std::string> strongest_bones(const Sources& sources) {
  std::vector<std::string> bones(BaseRanges::count);
  std::vector<double> most(BaseRanges::count, 0);
  for (const auto& [name, list] : sources.weights)
    for (const auto& [vertex, weight] : list)
      if (weight > most[vertex]) {
        most[vertex] = weight;
        bones[vertex] = name;
      }
  return bones;
}

Eigen::Vector3d joint(const Sources& sources, const std::string& bone) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto& head = sources.bones.at(bone).head;
  for (int v : head) sum += sources.base.vertices[v] / static_cast<double>(head.size());
  return sum;
}

}  // namespace

bool BaseMeasures::is_exact(std::size_t measure) {
  constexpr std::array<std::string_view, 7> exact = {"stature",
                                                     "crotchheight",
                                                     "waistcircumference",
                                                     "chestcircumference",
                                                     "buttockcircumference",
                                                     "thighcircumference",
                                                     "calfcircumference"};
  return std::find(exact.begin(), exact.end(), survey_measures[measure]) != exact.end();
}

BaseMeasures::BaseMeasures(const Sources& sources) {
  const std::vector<Eigen::Vector3d>& at = sources.base.vertices;
  const std::vector<std::string> bone = strongest_bones(sources);
  // Triangles of the skin moved by bones whose names start with one of `starts` and, with a side, end with it.
  const auto skin = [&](std::initializer_list<const char*> starts, const char* side) {
    std::vector<Eigen::Vector3i> triangles;
    for (const Eigen::Vector3i& t : sources.base.triangles) {
      if (!(t.array() < BaseRanges::body).all()) continue;
      bool all = true;
      for (int k = 0; k < 3; ++k)
        all = all && bone[t[k]].ends_with(side) && std::any_of(starts.begin(), starts.end(), [&](const char* start) {
                return bone[t[k]].starts_with(start);
              });
      if (all) triangles.push_back(t);
    }
    return triangles;
  };
  const auto trunk = skin({"root", "spine", "pelvis", "breast", "clavicle", "shoulder", "upperleg"}, "");
  const auto neck = skin({"neck", "head", "spine01"}, "");
  const auto leg = skin({"upperleg", "lowerleg", "foot"}, ".L");
  const auto arm = skin({"upperarm", "lowerarm", "wrist", "metacarpal"}, ".L");
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  const auto level = [&](const std::vector<Eigen::Vector3i>& triangles, double y) {
    return tape_through(at, triangles, {0, y, 0}, up);
  };
  const auto across = [&](const std::vector<Eigen::Vector3i>& triangles, const char* from, const char* to,
                          double share) {
    const Eigen::Vector3d a = joint(sources, from), b = joint(sources, to);
    return tape_through(at, triangles, a + share * (b - a), (b - a).normalized());
  };
  const Eigen::Vector3d knee_joint = joint(sources, "lowerleg01.L"), ankle = joint(sources, "foot.L");
  const auto down_shank = [&](double share) {
    return level(leg, knee_joint.y() + share * (ankle.y() - knee_joint.y()));
  };
  const Eigen::Vector3d throat = joint(sources, "neck01") + Eigen::Vector3d(0, 0.01, 0);
  const Eigen::Vector3d neck_axis = Eigen::Vector3d(0, 0.94, 0.34).normalized();  // it leans forwards
  // The back of the neck at the height of its lowest joint.
  const double nape_height = joint(sources, "neck01").y();
  int nape = crown;
  for (int v = 0; v < BaseRanges::body; ++v)
    if (std::abs(at[v].x()) < 1e-4 && at[v].z() < 0 &&
        std::abs(at[v].y() - nape_height) < std::abs(at[nape].y() - nape_height))
      nape = v;
  int sole = heel;
  for (int v = 0; v < BaseRanges::body; ++v)
    if (at[v].y() < at[sole].y()) sole = v;

  const std::map<std::string_view, Rule> rules = {
      {"stature", {Rule::height, {}, 0, crown, sole}},
      {"crotchheight", {Rule::height, {}, 0, crotch, sole}},
      {"kneeheightmidpatella", {Rule::height, {}, 0, knee, sole}},
      {"cervicaleheight", {Rule::height, {}, 0, nape, sole}},
      {"waistcircumference", {Rule::girth, level(trunk, at[navel].y())}},
      {"chestcircumference", {Rule::girth, level(trunk, at[nipple].y())}},
      {"buttockcircumference", {Rule::girth, level(trunk, at[buttock].y())}},
      {"waistdepth", {Rule::extent, level(trunk, at[navel].y()), 2}},
      {"chestdepth", {Rule::extent, level(trunk, at[nipple].y()), 2}},
      {"hipbreadth", {Rule::extent, level(trunk, at[buttock].y()), 0}},
      {"neckcircumference", {Rule::girth, tape_through(at, neck, throat, neck_axis)}},
      {"thighcircumference", {Rule::girth, level(leg, at[crotch].y() - 0.03)}},
      {"lowerthighcircumference", {Rule::girth, level(leg, at[knee].y() + 0.05)}},
      {"calfcircumference", {Rule::girth, down_shank(0.3)}},
      {"anklecircumference", {Rule::girth, down_shank(0.85)}},
      {"bicepscircumferenceflexed", {Rule::girth, across(arm, "upperarm01.L", "lowerarm01.L", 0.55)}},
      {"wristcircumference", {Rule::girth, across(arm, "lowerarm01.L", "wrist.L", 0.95)}},
      {"acromionradialelength", {Rule::length, {}, 0, left_acromion, left_elbow}},
      {"radialestylionlength", {Rule::length, {}, 0, left_elbow, left_wrist}},
      {"biacromialbreadth", {Rule::length, {}, 0, left_acromion, sources.mirror[left_acromion]}}};
  std::map<int, int> index;
  const auto used = [&](int vertex) {
    const auto [place, is_new] = index.try_emplace(vertex, static_cast<int>(vertices_.size()));
    if (is_new) vertices_.push_back(vertex);
    return place->second;
  };
  for (const std::string_view name : survey_measures) {
    assert(rules.count(name));
    Rule rule = rules.at(name);
    for (Tape::Crossing& c : rule.tape.crossings) {
      c.a = used(c.a);
      c.b = used(c.b);
    }
    rule.a = used(rule.a);
    rule.b = used(rule.b);
    rules_.push_back(std::move(rule));
  }
}

Measures BaseMeasures::of(const Eigen::Matrix3Xd& positions) const {
  Measures measures{};
  for (std::size_t m = 0; m < rules_.size(); ++m) {
    const Rule& rule = rules_[m];
    switch (rule.kind) {
      case Rule::girth:
        measures[m] = gyre::girth(positions, rule.tape);
        break;
      case Rule::extent:
        measures[m] = gyre::extent(positions, rule.tape, rule.axis);
        break;
      case Rule::height:
        measures[m] = positions(1, rule.a) - positions(1, rule.b);
        break;
      case Rule::length:
        measures[m] = (positions.col(rule.a) - positions.col(rule.b)).norm();
        break;
    }
  }
  return measures;
}

}  // namespace gyre
