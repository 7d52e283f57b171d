// SPDX-License-Identifier: Apache-2.0
// Landmarks that a person or a script has picked, and the file they are given in.
//
//   {"version": 1, "landmarks": {"noseTip": {"position": [0.01, 1.52, 0.13]},
//                                "leftEyeInner": {"pixels": {"head-000012.jpg": [361.5, 402.0]}}}}
//
// A position is in metres in the world of the cloud; pixels are those of keyframes, the centre of the first is
// (0.5, 0.5).
#pragma once

#include "offload/landmarks/detector.h"

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>

namespace gyre {

struct PickedPoint {
  std::optional<Eigen::Vector3d> position;
  std::map<std::string, Eigen::Vector2d> pixels;  // keyframe -> pixel
};

// Name -> point. Errors: a name that is no landmark's, numbers that are not finite or out of bounds, a point with
// neither position nor pixels.
Result<std::map<std::string, PickedPoint>> picked_from_json(const nlohmann::json& json);
nlohmann::json to_json(const std::map<std::string, PickedPoint>& points);
Result<std::map<std::string, PickedPoint>> read_picked(const std::filesystem::path& file);

class PickedDetector : public LandmarkDetector {
 public:
  explicit PickedDetector(std::map<std::string, PickedPoint> points) : points_(std::move(points)) {}
  std::string source() const override { return "picked"; }
  // Points in space are taken as they are, points in pictures are left to be placed. Pictures without a camera are
  // named as the reason.
  Result<Detections> detect(const Subject& subject, const Progress& progress) override;

 private:
  std::map<std::string, PickedPoint> points_;
};

}  // namespace gyre
