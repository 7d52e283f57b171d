// SPDX-License-Identifier: Apache-2.0
// What a network sees of a person in one picture, and which pictures show a part of the body best.
#pragma once

#include "offload/landmarks/keypoint_network.h"

#include <string>
#include <vector>

namespace gyre {

struct Skeleton {
  int view = 0;
  std::vector<Keypoint> keypoints;
};

// True for a skeleton with at least four bones (both ends with confidence 0.3 or more) whose best keypoint has at least
// 0.5; others are chance finds (Wenninger et al., "Realistic virtual humans from smartphone videos", VRST 2020).
bool is_person(const Skeleton& skeleton, const KeypointLayout& layout);

// A landmark's keypoints (their mean counts).
struct NamedKeypoint {
  std::string name;
  std::vector<int> indices;
};

// Landmarks that are best seen in the same pictures.
struct LandmarkGroup {
  std::vector<NamedKeypoint> points;
  std::vector<int> skeletons;  // indices of the best ones, the best first, at most `count`
};

// The groups of the same paper: hands and ears of each side from pictures along the lateral axis (the shoulders nearly
// cover each other; the side is the one whose fingers and ear are seen more confidently), heels from behind (the left
// one in the left half, toes above, at equal height), the face from the most frontal picture (symmetric about its
// middle, eyes as high as they can be).
std::vector<LandmarkGroup> choose_views(const std::vector<Skeleton>& skeletons, const KeypointLayout& layout,
                                        int count);

}  // namespace gyre
