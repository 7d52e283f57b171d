// SPDX-License-Identifier: Apache-2.0
// From the cloud of a person to the template in that person's shape and pose.
#pragma once

#include "common/log/log.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/body/body_state.h"
#include "offload/body/template.h"
#include "offload/fit/coarse_fit.h"
#include "offload/fit/nonrigid_fit.h"
#include "offload/fit/stance.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

struct PersonFitOptions {
  bool metric = true;  // false: the cloud's scale is a guess, so the body's may be anything
  CoarseFitOptions coarse;
  NonrigidFitOptions nonrigid;
  int threads = 0;
};

// One guess of the facing and how well a body fits that way.
struct FacingGuess {
  double yaw = 0.0;     // radians at the start of its fit
  double misfit = 0.0;  // metres, see CoarseFit
  double toes = 0.0;    // how far the feet point this way, in heights
  double cost = 0.0;    // metres; the least one wins
};

struct PersonFit {
  BodyState state;                                 // of the coarse fit; the surface below departs from it
  BodyPose pose;                                   // its rotations, with the translation that belongs to rest_joints
  std::vector<Eigen::Vector3d> vertices;           // posed, world, whole template
  std::vector<Eigen::Vector3d> rest_vertices;      // unposed, soles on y = 0
  std::vector<Eigen::Vector3d> rest_joints;        // regressed from them
  std::vector<Eigen::Affine3d> posed_from_rest;    // per joint; skinning the rest vertices with them gives `vertices`
  std::vector<FacingGuess> guesses;                // best first
  std::map<std::string, double> support;           // region -> share of its vertices with a counterpart in the cloud
  double residual_mean = 0.0, residual_p95 = 0.0;  // metres, cloud to surface
  double stature = 0.0;                            // metres, of the rest surface
  std::vector<std::string> warnings;               // what a person should know, one sentence each
};

// Facing, coarse fit, non-rigid fit, inner parts, rest surface. Errors: a cloud without usable points. A cloud that
// does not look like a person in A-pose is fitted all the same, with a warning.
Result<PersonFit> fit_person(const BodyTemplate& body, const PointCloud& cloud, const PersonFitOptions& options = {},
                             const Progress& progress = {});

// Name of a region as it is written in files: "left arm".
std::string region_name(BodyRegion region);

}  // namespace gyre
