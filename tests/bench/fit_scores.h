// SPDX-License-Identifier: Apache-2.0
// Errors of a fitted person against the true surface and skeleton of a rendered capture.
#pragma once

#include "offload/fit/person_fit.h"
#include "offload/report/truth.h"

#include <Eigen/Geometry>
#include <filesystem>
#include <string>

namespace gyre {

// One JSON line on standard output.
void print_figure(const std::string& name, const std::string& metric, double value, const std::string& unit);

// Mean and 95th percentile, given in metres, printed in mm.
void print_distances(const std::string& name, const std::string& metric, std::vector<double> metres);

// Takes the fit's world to the truth's: upright, by the fitted heading, then by iterated closest points without scale.
Eigen::Isometry3d truth_from_fit(const BodyTemplate& body, const PersonFit& fit, const TriangleMesh& truth);

// Prints surface errors both ways over what cameras see (the whole, and the face: the true surface in front of and
// between the ears, chin to brow), those of the joints that fit and truth name alike, the eyeballs', stature against
// `height` (metres; 0: not known), folds, support and measures. The whole is that of pass "body", the face that of pass
// "head" where there is one.
void print_scores(const std::string& name, const BodyTemplate& body, const PersonFit& fit, const Truth& truth,
                  const Eigen::Isometry3d& truth_from_world, double height);

// Pictures of body, head from four sides, hand and feet, and the mesh, in the truth's world.
void write_views(const BodyTemplate& body, const PersonFit& fit, const Eigen::Isometry3d& truth_from_world,
                 const std::filesystem::path& folder, const std::string& name);

}  // namespace gyre
