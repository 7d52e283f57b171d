// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/merge.h"

#include "offload/landmarks/placement.h"

#include <algorithm>

namespace gyre {

namespace {

// Places what was seen in pictures; reasons of failure go to `missing`.
void place_pixels(const Subject& subject, const std::string& source, Detections& found) {
  std::map<std::string, std::vector<PixelDetection>> by_name;
  for (const PixelDetection& detection : found.pixels) by_name[detection.name].push_back(detection);
  for (const auto& [name, detections] : by_name) {
    if (std::any_of(found.placed.begin(), found.placed.end(),
                    [&, n = name](const PlacedLandmark& mark) { return mark.name == n; }))
      continue;  // a place in space needs no picture
    auto mark = place_landmark(subject, detections, source);
    if (mark) {
      found.placed.push_back(std::move(*mark));
    } else {
      found.missing[name] = mark.error();
    }
  }
  found.pixels.clear();
}

// How the names' sides lie against the facing: more than 0 when left landmarks lie on the left.
double sidedness(const Subject& subject, const std::vector<PlacedLandmark>& placed) {
  double sum = 0;
  for (const PlacedLandmark& mark : placed) {
    const double outward = subject.figure.outward(mark.position, subject.facing.left());
    if (mark.name.starts_with("left")) sum += outward;
    if (mark.name.starts_with("right")) sum -= outward;
  }
  return sum;
}

}  // namespace

Result<LandmarkSet> detect_landmarks(const Subject& subject,
                                     const std::vector<std::unique_ptr<LandmarkDetector>>& detectors,
                                     const Progress& progress) {
  LandmarkSet set;
  set.yaw_certainty = subject.facing.certainty;
  set.yaw_reasons = subject.facing.reasons;
  if (subject.facing.towards_across) set.yaw = subject.facing.yaw;

  std::map<std::string, PlacedLandmark> placed;
  for (std::size_t i = 0; i < detectors.size(); ++i) {
    const double share = 1.0 / static_cast<double>(detectors.size());
    auto found = detectors[i]->detect(subject, [&](double fraction, std::string_view what) {
      progress((static_cast<double>(i) + fraction) * share, what);
    });
    if (!found) return tl::unexpected(found.error());
    place_pixels(subject, detectors[i]->source(), *found);
    if (detectors[i]->source() == "network" && subject.facing.towards_across && sidedness(subject, found->placed) < 0) {
      set.yaw_reasons.emplace_back(
          "the network takes left for right against feet, nose and hands, so its landmarks are not used");
      set.yaw_certainty *= 0.5;
      continue;
    }
    for (const auto& [name, reason] : found->missing)
      if (!placed.contains(name)) set.missing[name] = reason;
    for (PlacedLandmark& mark : found->placed) {
      set.missing.erase(mark.name);
      placed[mark.name] = std::move(mark);
    }
  }
  for (auto& [name, mark] : placed) set.placed.push_back(std::move(mark));
  return set;
}

}  // namespace gyre
