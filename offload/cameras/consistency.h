// SPDX-License-Identifier: Apache-2.0
// Finding what repeated texture has put in the wrong place: pairs that contradict other pairs, views that contradict
// their neighbours in the walk.
#pragma once

#include "offload/cameras/scene.h"

#include <span>
#include <vector>

namespace gyre {

struct ConsistencyOptions {
  double max_error = 4.0;       // Sampson distance of a match that agrees with two poses, pixels
  double min_agreement = 0.5;   // share of its matches that a pair needs to agree
  int near = 3;                 // views up to this many apart in one walk are trusted neighbours
  double trust_in_near = 10.0;  // a match between those is worth this many others when rotations are averaged
  double max_turn = 0.25;       // between a pair's relative rotation and the averaged ones, radians
};

// For every view the indices of the pairs it takes part in.
std::vector<std::vector<int>> pairs_of_views(const Scene& scene, std::span<const ViewPair> pairs);

// True for two views close to each other in one walk.
bool are_near(const View& a, const View& b, const ConsistencyOptions& options);

// True when the view's pose agrees with the pairs it forms with registered views: half of all their matches, and half
// of those with near views when there are any. Repeated texture makes false pairs, but rarely between neighbours.
bool agrees_with_pairs(const Scene& scene, std::span<const ViewPair> pairs, std::span<const int> pairs_of_view,
                       int view, const ConsistencyOptions& options);

// Pairs of registered views reduced to the matches that agree with the poses; pairs that mostly disagree are left out.
// Pairs with a view that is not registered stay as they are.
std::vector<ViewPair> consistent_pairs(const Scene& scene, std::span<const ViewPair> pairs,
                                       const ConsistencyOptions& options, int threads);

// Pairs without those of distant views whose relative rotation contradicts the average of all (rotation_averaging.h):
// a room that repeats itself makes them, and a model that grows along one of them breaks. Needs the cameras' focal
// lengths and View::normalised, but no poses.
std::vector<ViewPair> pairs_that_close(const Scene& scene, std::span<const ViewPair> pairs,
                                       const ConsistencyOptions& options, int threads);

}  // namespace gyre
