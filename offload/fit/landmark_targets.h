// SPDX-License-Identifier: Apache-2.0
// Placed landmarks as the fit uses them: a vertex of the template, where it should be, and how far that can be trusted.
#pragma once

#include "offload/body/landmark_set.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <string>
#include <vector>

namespace gyre {

struct LandmarkTarget {
  std::string name;
  int vertex = -1;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();         // metres, world
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();  // inverse of the covariance, m^-2, see below
  double trust = 1.0;                                         // in (0, 1], of the measurement alone
};

// The landmarks of the set that the template has, in the set's order. To the covariance of the measurement comes that
// of the meaning: people and templates place a landmark differently by some millimetres on a face, by centimetres where
// cloth or hair lies over it. The crown is the top of the hair: its height says where the hair ends and not the skull.
std::vector<LandmarkTarget> landmark_targets(const BodyTemplate& body, const LandmarkSet& set);

// True for landmarks of the face and the ears, which move with the head.
bool on_head(const std::string& landmark);

}  // namespace gyre
