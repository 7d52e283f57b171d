// SPDX-License-Identifier: Apache-2.0
// From places in pictures to places in space: rays against the cloud, and several rays against each other.
#pragma once

#include "offload/landmarks/detector.h"

#include <optional>
#include <span>
#include <string>

namespace gyre {

struct PlacementOptions {
  double support_radius = 0.004;  // metres around the ray that points of the cloud count in
  int support_points = 4;         // that make a surface
  double agreement = 0.015;       // metres that the surfaces hit by several rays may lie apart
};

// Where a ray first meets the cloud.
struct CloudHit {
  double depth = 0.0;      // metres along the ray
  double deviation = 0.0;  // of the depth, metres
};

// The nearest place along the ray (unit direction) with enough points around it whose normals look back at the ray's
// origin. The radius grows with `pixel_radius`, what a pixel spans per metre of depth. Nothing where the cloud has a
// hole.
std::optional<CloudHit> hit_cloud(const PointCloud& cloud, const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction, double pixel_radius,
                                  const PlacementOptions& options = {});

// One landmark from its detections in several pictures (all of one name). Every ray is held against the cloud; the
// largest group of hits that agree is kept and their rays and hits are combined by their covariances (linear
// least squares). Without any hit two or more rays that meet within 3 standard deviations are triangulated. The error
// is why it cannot be placed.
tl::expected<PlacedLandmark, std::string> place_landmark(const Subject& subject,
                                                         std::span<const PixelDetection> detections,
                                                         const std::string& source,
                                                         const PlacementOptions& options = {});

}  // namespace gyre
