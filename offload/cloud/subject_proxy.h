// SPDX-License-Identifier: Apache-2.0
// A stand-in for the unknown subject, to ask which views look at the same.
#pragma once

#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

struct ProxyPoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};

// The side and top of a slim upright cylinder inside the region.
std::vector<ProxyPoint> proxy_surface(const SubjectRegion& region);

// What one view sees of a point.
struct Sighting {
  bool seen = false;          // it faces the view and lies in the picture
  Eigen::Vector3d direction;  // unit, from the point to the camera
  double pixels_per_metre = 0;
};

std::vector<Sighting> sightings(const StereoView& view, const std::vector<ProxyPoint>& points);

}  // namespace gyre
