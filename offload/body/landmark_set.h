// SPDX-License-Identifier: Apache-2.0
// Named points of a subject's surface in space, which way it faces, and the file work/landmarks/landmarks.json.
#pragma once

#include "common/result/result.h"

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// A landmark where it was found. Its name is one of BodyTemplate::landmarks ("noseTip", "leftHeel").
struct PlacedLandmark {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();        // metres, world
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // square metres
  std::string source;                                        // "geometric", "network", "picked"
  std::vector<std::string> views;                            // keyframes it was seen in; may be empty
};

struct LandmarkSet {
  std::vector<PlacedLandmark> placed;          // at most one a name
  std::map<std::string, std::string> missing;  // name -> why it could not be placed, one sentence
  std::optional<double> yaw;             // radians counter-clockwise from above, 0 = facing +Z; empty: not decided
  double yaw_certainty = 0.0;            // 0 ... 1
  std::vector<std::string> yaw_reasons;  // one sentence each

  const PlacedLandmark* find(std::string_view name) const;  // nullptr: not placed
};

// The names that landmarks are looked for under, those of the left side before their mirror images.
const std::vector<std::string>& landmark_names();

nlohmann::json to_json(const LandmarkSet& set);

// Every field is checked: numbers are finite, covariances symmetric and positive semi-definite, sources known, names
// unique, and none both placed and missing. The error names the first fault.
Result<LandmarkSet> landmarks_from_json(const nlohmann::json& json);

Result<LandmarkSet> read_landmarks(const std::filesystem::path& file);
Result<void> write_landmarks(const LandmarkSet& set, const std::filesystem::path& file);

}  // namespace gyre
