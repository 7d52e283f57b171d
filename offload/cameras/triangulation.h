// SPDX-License-Identifier: Apache-2.0
// Points of the world from keypoints of registered views.
#pragma once

#include "offload/cameras/scene.h"

#include <Eigen/Core>
#include <optional>
#include <span>

namespace gyre {

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  // unit length
};

// Angle between two rays' directions, radians in [0, pi].
double angle_between_rays(const Ray& a, const Ray& b);

// Point closest to all rays in least squares; nothing when they are parallel.
std::optional<Eigen::Vector3d> intersect_rays(std::span<const Ray> rays);

struct TriangulationOptions {
  double max_error = 4.0;                         // reprojection error of a used observation, pixels
  double min_angle = 1.5 * 0.017453292519943295;  // largest angle between two rays of a point, radians
};

// Triangulates a track from its observations in registered views and marks those that agree as used. The point is the
// one most observations agree with among intersections of two rays, refined on the reprojection error of those. False,
// and the track is left without a point, when fewer than two agree or their rays are too parallel.
bool triangulate(const Scene& scene, Track& track, const TriangulationOptions& options);

// Drops used observations whose error is too large and points with too few or too parallel rays. Returns how many
// observations were dropped.
int filter_points(Scene& scene, const TriangulationOptions& options);

// Triangulates every track without a point that two registered views see, and lets points take up unused observations
// that agree. Returns how many observations were added.
int extend_points(Scene& scene, const TriangulationOptions& options, int threads);

// The same for the tracks of one view that has just been registered.
int extend_points_of_view(Scene& scene, int view, const TriangulationOptions& options);

}  // namespace gyre
