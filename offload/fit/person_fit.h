// SPDX-License-Identifier: Apache-2.0
// From the cloud of a person to the template in that person's shape and pose.
#pragma once

#include "common/log/log.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/body/body_state.h"
#include "offload/body/template.h"
#include "offload/fit/coarse_fit.h"
#include "offload/fit/fit_quality.h"
#include "offload/fit/head_alignment.h"
#include "offload/fit/nonrigid_fit.h"
#include "offload/fit/person_measures.h"
#include "offload/fit/stance.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// The schedule of the head's own pass: from where the body's ends to softer.
NonrigidFitOptions head_surface_options();

struct PersonFitOptions {
  bool metric = true;              // false: the cloud's scale is a guess, so the body's may be anything
  double scale_deviation = 0.005;  // relative, of the cloud's lengths; for the measures
  CoarseFitOptions coarse;
  HeadAlignmentOptions head;
  NonrigidFitOptions nonrigid;
  NonrigidFitOptions head_surface = head_surface_options();
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
  BodyState state;                               // of the coarse fit; the surface below departs from it
  BodyPose pose;                                 // its rotations, with the translation that belongs to rest_joints
  std::vector<Eigen::Vector3d> vertices;         // posed, world, whole template
  std::vector<Eigen::Vector3d> rest_vertices;    // unposed, soles on y = 0
  std::vector<Eigen::Vector3d> rest_joints;      // regressed from them
  std::vector<Eigen::Affine3d> posed_from_rest;  // per joint; skinning the rest vertices with them gives `vertices`
  std::vector<FacingGuess> guesses;              // best first
  FitQuality quality;                            // of `vertices`
  std::map<std::string, Measure> measures;       // see measure_person
  double stature = 0.0;                          // metres, floor to the top of the hair, as the person stood
  std::vector<std::string> warnings;             // what a person should know, one sentence each
};

// Facing, coarse fit, head, non-rigid fit of the body and of the head, inner parts, rest surface, measures. Any subset
// of the template's landmarks helps, none is needed; a heading of which they are certain is believed. Errors: a cloud
// without usable points. A cloud that does not look like a person in A-pose is fitted all the same, with a warning.
Result<PersonFit> fit_person(const BodyTemplate& body, const PointCloud& cloud, const LandmarkSet& landmarks = {},
                             const PersonFitOptions& options = {}, const Progress& progress = {});

}  // namespace gyre
