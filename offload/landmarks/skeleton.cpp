// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/skeleton.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

namespace gyre {

namespace {

constexpr double least_confidence = 0.3;  // confidence of a keypoint that counts

const Keypoint& at(const Skeleton& skeleton, int index) {
  return skeleton.keypoints[index];
}

bool all_seen(const Skeleton& skeleton, std::initializer_list<int> indices) {
  return std::all_of(indices.begin(), indices.end(),
                     [&](int i) { return at(skeleton, i).confidence >= least_confidence; });
}

// Height of the skeleton in its picture.
double size_of(const Skeleton& skeleton) {
  double low = 1e9, high = -1e9;
  for (const Keypoint& k : skeleton.keypoints) {
    if (k.confidence < least_confidence) continue;
    low = std::min(low, k.pixel.y());
    high = std::max(high, k.pixel.y());
  }
  return std::max(high - low, 1.0);
}

double mean_confidence(const Skeleton& skeleton, int first, int count) {
  double sum = 0;
  for (int i = first; i < first + count; ++i) sum += at(skeleton, i).confidence / count;
  return sum;
}

// How good a picture is for a group; nothing: not at all.
using Measure = std::function<std::optional<double>(const Skeleton&)>;

std::optional<double> lateral(const Skeleton& skeleton, const KeypointLayout& layout, int side) {
  if (!all_seen(skeleton, {layout.shoulder[0], layout.shoulder[1]})) return std::nullopt;
  const auto confidence = [&](int s) {
    return mean_confidence(skeleton, layout.hand[s], 21) + at(skeleton, layout.ear[s]).confidence;
  };
  if (confidence(side) < confidence(1 - side)) return std::nullopt;
  const double apart =
      std::abs(at(skeleton, layout.shoulder[0]).pixel.x() - at(skeleton, layout.shoulder[1]).pixel.x());
  return -apart / size_of(skeleton);
}

std::optional<double> dorsal(const Skeleton& skeleton, const KeypointLayout& layout) {
  if (!all_seen(skeleton, {layout.heel[0], layout.heel[1]})) return std::nullopt;
  const Keypoint &left = at(skeleton, layout.heel[0]), &right = at(skeleton, layout.heel[1]);
  // Seen from behind, the left heel lies left of the right one.
  if (left.pixel.x() >= right.pixel.x()) return std::nullopt;
  for (int side = 0; side < 2; ++side) {
    const Keypoint& toe = at(skeleton, layout.toe[side]);
    if (toe.confidence >= least_confidence && toe.pixel.y() > at(skeleton, layout.heel[side]).pixel.y())
      return std::nullopt;
  }
  const double unequal = std::abs(left.pixel.y() - right.pixel.y()) / size_of(skeleton);
  if (unequal > 0.03) return std::nullopt;
  return std::min(left.confidence, right.confidence) - 10 * unequal;
}

std::optional<double> frontal(const Skeleton& skeleton, const KeypointLayout& layout) {
  const auto face = [&](int i) -> const Keypoint& { return at(skeleton, layout.face + i); };
  double confidence = 0;
  for (int i = 0; i < 68; ++i) confidence += face(i).confidence / 68;
  if (confidence < least_confidence) return std::nullopt;
  // Symmetry of the outline and the corners of the eyes about the line through nose and chin.
  double unequal = 0;
  for (const auto& [right, left] : {std::pair{0, 16}, {2, 14}, {4, 12}, {36, 45}, {39, 42}, {48, 54}}) {
    const double to_right = std::abs(face(right).pixel.x() - face(30).pixel.x()),
                 to_left = std::abs(face(left).pixel.x() - face(30).pixel.x());
    unequal += std::abs(to_right - to_left) / std::max(to_right + to_left, 1.0) / 6;
  }
  double open = 0;
  for (const int first : {36, 42}) {
    const double width = (face(first + 3).pixel - face(first).pixel).norm();
    const double height = 0.5 * (std::abs(face(first + 5).pixel.y() - face(first + 1).pixel.y()) +
                                 std::abs(face(first + 4).pixel.y() - face(first + 2).pixel.y()));
    open += 0.5 * height / std::max(width, 1.0);
  }
  return (1 - unequal) + std::min(open, 0.5);
}

}  // namespace

bool is_person(const Skeleton& skeleton, const KeypointLayout& layout) {
  double best = 0;
  for (const Keypoint& k : skeleton.keypoints) best = std::max(best, k.confidence);
  int bones = 0;
  for (const auto& [a, b] : layout.bones) bones += all_seen(skeleton, {a, b}) ? 1 : 0;
  return bones >= 4 && best >= 0.5;
}

std::vector<LandmarkGroup> choose_views(const std::vector<Skeleton>& skeletons, const KeypointLayout& layout,
                                        int count) {
  std::vector<std::pair<LandmarkGroup, Measure>> groups;
  const auto sided = [](int side, const char* part) { return (side == 0 ? "left" : "right") + std::string(part); };
  for (int side = 0; side < 2; ++side) {
    const int hand = layout.hand[side];
    groups.push_back({{{{sided(side, "ThumbTip"), {hand + 4}},
                        {sided(side, "IndexTip"), {hand + 8}},
                        {sided(side, "Fingertip"), {hand + 12}},
                        {sided(side, "RingTip"), {hand + 16}},
                        {sided(side, "LittleTip"), {hand + 20}},
                        {sided(side, "Ear"), {layout.ear[side]}}},
                       {}},
                      [&layout, side](const Skeleton& s) { return lateral(s, layout, side); }});
  }
  groups.push_back({{{{"leftHeel", {layout.heel[0]}}, {"rightHeel", {layout.heel[1]}}}, {}},
                    [&layout](const Skeleton& s) { return dorsal(s, layout); }});
  const int f = layout.face;
  groups.push_back({{{{"sellion", {f + 27}},
                      {"noseTip", {f + 30}},
                      {"noseBase", {f + 33}},
                      {"chin", {f + 8}},
                      {"rightNostril", {f + 31, f + 32}},
                      {"leftNostril", {f + 34, f + 35}},
                      {"rightEyeOuter", {f + 36}},
                      {"rightUpperLid", {f + 37, f + 38}},
                      {"rightEyeInner", {f + 39}},
                      {"rightLowerLid", {f + 40, f + 41}},
                      {"leftEyeInner", {f + 42}},
                      {"leftUpperLid", {f + 43, f + 44}},
                      {"leftEyeOuter", {f + 45}},
                      {"leftLowerLid", {f + 46, f + 47}},
                      {"rightMouthCorner", {f + 48}},
                      {"leftMouthCorner", {f + 54}}},
                     {}},
                    [&layout](const Skeleton& s) { return frontal(s, layout); }});
  std::vector<LandmarkGroup> chosen;
  for (auto& [group, measure] : groups) {
    std::vector<std::pair<double, int>> order;
    for (std::size_t i = 0; i < skeletons.size(); ++i)
      if (const auto value = measure(skeletons[i])) order.emplace_back(-*value, static_cast<int>(i));
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < std::min<std::size_t>(order.size(), count); ++i)
      group.skeletons.push_back(order[i].second);
    chosen.push_back(std::move(group));
  }
  return chosen;
}

}  // namespace gyre
