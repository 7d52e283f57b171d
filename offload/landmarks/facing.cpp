// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/facing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

struct Cue {
  std::string name;
  double ratio = 0.0;  // log-likelihood of facing +across against facing away
};

// The shin stands on the rear third of the foot, and the heel's end is higher than the toes'.
std::optional<Cue> feet_cue(const BodyParts& parts) {
  double sum = 0;
  int count = 0;
  for (const auto& foot : parts.feet) {
    if (!foot) continue;
    double ratio = foot->heel_rise / 0.012;
    if (foot->shin_offset) ratio += *foot->shin_offset / 0.06;
    sum += std::clamp(ratio, -4.0, 4.0);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Cue{"the feet point", std::clamp(sum / count * (count == 2 ? 1.0 : 0.7), -4.0, 4.0)};
}

std::optional<Cue> face_cue(const BodyParts& parts) {
  const double towards = parts.faces[0] ? parts.faces[0]->score : 0, away = parts.faces[1] ? parts.faces[1]->score : 0;
  if (towards <= 0 && away <= 0) return std::nullopt;
  return Cue{"the nose points", std::clamp((towards - away) / 0.0015, -4.0, 4.0)};
}

// Elbows bend to the front, so that hands hang before the line through shoulder and elbow.
std::optional<Cue> hands_cue(const Figure& figure, const BodyParts& parts) {
  double sum = 0;
  int count = 0;
  for (const auto& arm : parts.arms) {
    if (!arm || arm->sections.back().along < 0.34 * figure.height) continue;
    const Eigen::Vector3d hand = centre_at(*arm, 0.10 * figure.height), elbow = centre_at(*arm, 0.27 * figure.height),
                          upper = centre_at(*arm, 0.34 * figure.height);
    const Eigen::Vector3d straight = elbow + (elbow - upper).normalized() * (hand - elbow).norm();
    sum += figure.depth(hand) - 0.5 * (figure.depth(straight) + figure.depth(elbow));
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Cue{"the hands are held", std::clamp(sum / count / 0.02, -1.5, 1.5)};
}

// Heading of the lateral axis, drawn towards the mean of the feet when both agree with it.
double heading(const Figure& figure, bool towards_across) {
  const Eigen::Vector3d forward = towards_across ? figure.across() : Eigen::Vector3d(-figure.across());
  return std::atan2(forward.x(), forward.z());
}

}  // namespace

Facing decide_facing(const Figure& figure, const BodyParts& parts) {
  std::vector<Cue> cues;
  for (const auto& cue : {feet_cue(parts), face_cue(parts), hands_cue(figure, parts)})
    if (cue) cues.push_back(*cue);
  double sum = 0;
  for (const Cue& cue : cues) sum += cue.ratio;
  double against = 0;
  for (const Cue& cue : cues)
    if (cue.ratio * sum < 0) against = std::max(against, std::abs(cue.ratio));
  Facing facing;
  const double yaw = heading(figure, sum >= 0);
  const auto degrees = [](double radians) { return std::lround(radians * 180 / M_PI); };
  for (const Cue& cue : cues)
    facing.reasons.push_back(fmt::format("{} to {} degrees ({})", cue.name, degrees(heading(figure, cue.ratio >= 0)),
                                         std::abs(cue.ratio) > 3   ? "clearly"
                                         : std::abs(cue.ratio) > 1 ? "probably"
                                                                   : "hardly to be told"));
  if (cues.empty()) facing.reasons.emplace_back("neither feet nor nose nor hands are in the cloud");
  facing.certainty = std::tanh(0.5 * std::abs(sum)) * (against > 1 ? 0.3 : 1.0);
  if (std::abs(sum) > 2.5 && against <= 1.0 && figure.elongation > 1.15) {
    facing.towards_across = sum > 0;
    facing.yaw = yaw;
  } else if (against > 1) {
    facing.reasons.emplace_back("these contradict each other, so the facing is left open");
  } else {
    facing.reasons.emplace_back("that is too little to decide the facing");
  }
  return facing;
}

}  // namespace gyre
