// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/true_landmarks.h"

#include <vector>

namespace gyre {

std::map<std::string, Eigen::Vector3d> true_landmarks_of_synthetic_a(const TriangleMesh& mesh) {
  static const std::map<std::string, std::vector<int>> vertices = {
      {"noseTip", {12073, 12074}},
      {"sellion", {12311, 12310}},
      {"noseBase", {11391, 11393}},
      {"upperLip", {11400}},
      {"lowerLip", {14995, 15035}},
      {"chin", {14783}},
      {"leftEyeInner", {14003}},
      {"rightEyeInner", {12451}},
      {"leftEyeOuter", {13718}},
      {"rightEyeOuter", {12537}},
      {"leftUpperLid", {13697}},
      {"rightUpperLid", {12490}},
      {"leftLowerLid", {13750}},
      {"rightLowerLid", {12556}},
      {"leftMouthCorner", {14951}},
      {"rightMouthCorner", {14624}},
      {"leftNostril", {11999, 11856, 11873, 11838}},
      {"rightNostril", {11990, 11904, 11942, 11899}},
  };
  std::map<std::string, Eigen::Vector3d> places;
  for (const auto& [name, picked] : vertices) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const int v : picked) mean += mesh.vertices.at(v) / static_cast<double>(picked.size());
    places[name] = mean;
  }
  return places;
}

bool is_face_landmark(const std::string& name) {
  return name == "noseTip" || name == "chin" || name.ends_with("EyeInner") || name.ends_with("EyeOuter") ||
         name.ends_with("MouthCorner") || name.ends_with("Nostril");
}

}  // namespace gyre
