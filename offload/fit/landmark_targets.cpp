// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/landmark_targets.h"

#include <Eigen/LU>
#include <array>
#include <string_view>

namespace gyre {

namespace {

// The name without its side, in small letters at its start: "leftEyeInner" -> "eyeInner".
std::string without_side(const std::string& name) {
  for (const std::string_view side : {"left", "right"}) {
    if (!name.starts_with(side) || name.size() <= side.size() || std::islower(name[side.size()]) != 0) continue;
    std::string rest = name.substr(side.size());
    rest[0] = static_cast<char>(std::tolower(rest[0]));
    return rest;
  }
  return name;
}

template <std::size_t N>
bool one_of(const std::string& name, const std::array<std::string_view, N>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Standard deviation of what is meant by the landmark, metres per axis.
double meaning_deviation(const std::string& plain) {
  constexpr std::array<std::string_view, 5> tips = {"thumbTip", "indexTip", "fingertip", "ringTip", "littleTip"};
  if (on_head(plain)) return plain == "jaw" || plain == "jawAngle" || plain.starts_with("ear") ? 0.008 : 0.004;
  if (one_of(plain, tips)) return 0.008;
  if (plain == "toe" || plain == "heel" || plain == "wrist" || plain == "ankle") return 0.015;  // shoes, cuffs
  return 0.03;
}

}  // namespace

bool on_head(const std::string& landmark) {
  constexpr std::array<std::string_view, 16> names = {
      "sellion",  "noseTip",  "noseBase", "nostril",     "upperLip", "lowerLip", "chin", "eyeInner",
      "eyeOuter", "upperLid", "lowerLid", "mouthCorner", "ear",      "earLobe",  "jaw",  "jawAngle"};
  return one_of(without_side(landmark), names);
}

std::vector<LandmarkTarget> landmark_targets(const BodyTemplate& body, const LandmarkSet& set) {
  std::vector<LandmarkTarget> targets;
  for (const PlacedLandmark& placed : set.placed) {
    const auto found = body.landmarks.find(placed.name);
    if (found == body.landmarks.end()) continue;
    LandmarkTarget target{placed.name, found->second, placed.position};
    const std::string plain = without_side(placed.name);
    const double meaning = meaning_deviation(plain);
    Eigen::Matrix3d covariance = placed.covariance + meaning * meaning * Eigen::Matrix3d::Identity();
    constexpr double hair = 0.06;  // metres
    if (plain == "crown") covariance(1, 1) += hair * hair;
    target.information = covariance.inverse();
    constexpr double good = 0.004;  // metres
    target.trust = good * good / (good * good + placed.covariance.trace() / 3.0);
    targets.push_back(std::move(target));
  }
  return targets;
}

}  // namespace gyre
