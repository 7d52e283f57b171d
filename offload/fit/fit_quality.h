// SPDX-License-Identifier: Apache-2.0
// How far a fitted surface can be believed: against the cloud, vertex by vertex and region by region.
#pragma once

#include "offload/body/template.h"
#include "offload/fit/correspondences.h"
#include "offload/fit/point_index.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

struct FitQuality {
  // Per template vertex: metres to the cloud's surface beside it along that surface's normal; not a number where the
  // cloud has nothing within reach.
  std::vector<double> residual;
  // Per template vertex, in [0, 1]: support by the cloud, less where the residual is large; 0: the template's guess.
  std::vector<double> confidence;
  std::map<std::string, double> support;           // region -> share of its vertices that the cloud supports
  std::vector<std::string> prior_only;             // regions that are mostly the template's, by name
  double residual_mean = 0.0, residual_p95 = 0.0;  // metres, cloud to surface
};

// vertices: posed, whole template. support: of NonrigidFit.
FitQuality measure_quality(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                           const std::vector<Eigen::Vector3d>& vertices, const std::vector<double>& support,
                           int threads);

// Name of a region as it is written in files: "left arm".
std::string region_name(BodyRegion region);

}  // namespace gyre
