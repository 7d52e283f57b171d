// SPDX-License-Identifier: Apache-2.0
// What stays at its place in the pictures of a pass: the room behind a subject that turns before a fixed camera.
#pragma once

#include "offload/cameras/features.h"
#include "offload/cameras/matching.h"
#include "offload/cameras/motion.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

struct StillnessOptions {
  double radius = 0.0015;     // a still keypoint is found again this near, as a share of the longer side
  double min_radius = 1.5;    // and at least this, pixels
  double max_shift = 0.02;    // of a whole picture against the others, as when a tripod is touched; share likewise
  double max_distance = 0.6;  // of unit descriptors
  double min_share = 0.3;     // of the other pictures of the pass that show a still keypoint too
  int min_pictures = 3;       // and at least this many of them
  double surroundings = 4.0;  // of a keypoint, in standard deviations of its Gaussian, in which no still one may lie
  int compared = 40;          // others a picture is compared with, at most, evenly spread over the pass
  int min_keypoints = 20;     // still ones for a picture to have a background
  int min_cells = 6;          // of a 12 x 12 grid over the picture that they lie in: a burned-in date is no room
};

// What was found of a pass or, joined, of several; per picture.
struct StaticBackground {
  std::vector<Motion> motion;
  std::vector<Eigen::Vector2d> shift;    // of the background against its mean place, pixels
  std::vector<std::vector<char>> still;  // per keypoint: 1 when it is, or touches, background
};

// A keypoint is still when many pictures of its pass have one at the same pixel that looks the same: all that turns
// with the subject is gone from a pixel some degrees later, and all that a walking camera sees moves. A pass is a turn
// when most of its pictures have a still background. pass_of: per picture, which pass it belongs to. The result does
// not depend on threads.
StaticBackground find_static_background(std::span<const Features> features, std::span<const int> pass_of,
                                        const StillnessOptions& options, int threads);

// The features without the still keypoints.
Features without_still(const Features& features, const std::vector<char>& still);

// Drops the matches of two pictures of one turn, a and b, that have moved no more than a still background. Keypoints
// that are too weak to be found in many pictures are left to this; and of the subject it takes only what has hardly
// turned between the two, which tells nothing about their cameras.
void drop_still_matches(std::vector<Match>& matches, const Features& features_a, const Features& features_b,
                        const Eigen::Vector2d& shift_of_b_against_a, const StillnessOptions& options);

}  // namespace gyre
