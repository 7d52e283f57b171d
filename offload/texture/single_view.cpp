// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/single_view.h"

#include <algorithm>
#include <map>

namespace gyre {

std::vector<std::uint8_t> face_features(const BodyTemplate& body) {
  struct Feature {
    const char* from;
    const char* to;
    double reach;  // from the middle, in distances between the two
  };
  constexpr Feature features[] = {{"leftEyeInner", "leftEyeOuter", 0.75},
                                  {"rightEyeInner", "rightEyeOuter", 0.75},
                                  {"leftMouthCorner", "rightMouthCorner", 0.65}};
  std::vector<std::uint8_t> feature(body.mesh.triangles.size(), 0);
  std::uint8_t number = 0;
  for (const Feature& f : features) {
    ++number;
    const auto from = body.landmarks.find(f.from);
    const auto to = body.landmarks.find(f.to);
    if (from == body.landmarks.end() || to == body.landmarks.end()) continue;
    const Eigen::Vector3d& a = body.mesh.vertices[from->second];
    const Eigen::Vector3d& b = body.mesh.vertices[to->second];
    const double reach = f.reach * (b - a).norm();
    for (std::size_t t = 0; t < feature.size(); ++t) {
      const Eigen::Vector3i& corners = body.mesh.triangles[t];
      const Eigen::Vector3d middle =
          (body.mesh.vertices[corners[0]] + body.mesh.vertices[corners[1]] + body.mesh.vertices[corners[2]]) / 3.0;
      if ((middle - 0.5 * (a + b)).norm() < reach) feature[t] = number;
    }
  }
  return feature;
}

void hold_to_one_view(const ObservationTable& table, std::span<const std::uint8_t> feature,
                      std::vector<std::vector<Candidate>>& candidates) {
  if (feature.empty()) return;
  const int features = *std::max_element(feature.begin(), feature.end());
  for (int number = 1; number <= features; ++number) {
    std::map<int, double> worth;  // of photographs
    for (std::size_t t = 0; t < candidates.size(); ++t) {
      if (feature[t] != number) continue;
      float best = 0;
      for (const Observation& o : table.of(t)) best = std::max(best, o.score);
      for (const Observation& o : table.of(t)) {
        // To be seen at all counts as much as to be seen best.
        if (best > 0) worth[o.photo] += 1.0 + double{o.score / best} * (o.quality == ViewQuality::strict ? 1.0 : 0.5);
      }
    }
    if (worth.empty()) continue;
    const int chosen =
        std::max_element(worth.begin(), worth.end(), [](auto& a, auto& b) { return a.second < b.second; })->first;
    for (std::size_t t = 0; t < candidates.size(); ++t) {
      if (feature[t] != number || candidates[t].empty()) continue;
      for (const Observation& o : table.of(t)) {
        if (o.photo == chosen) candidates[t] = {{chosen, 0.0F, o.quality}};
      }
    }
  }
}

}  // namespace gyre
