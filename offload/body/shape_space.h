// SPDX-License-Identifier: Apache-2.0
// Bodies drawn like the people of a survey, and the principal components of such bodies.
#pragma once

#include "offload/body/ansur.h"
#include "offload/body/makehuman.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

struct BodySampleOptions {
  int count = 600;  // half of each sex
  std::uint64_t seed = 20120;
  double local_sd = 0.3;  // spread of the local measure targets, whose full range is [-1, 1]
  int threads = 0;
};

// Vertices of the base mesh (helpers included, metres) of `count` adults of 18 to 70 years. For each, a person of the
// survey is drawn; height and weight parameters are solved so that the body has the person's stature and waist girth,
// the others are random. A body is drawn again when these cannot be reached, or when its chest or buttock girth leaves
// the survey's 1st to 99th percentile. Soles on y = 0, pelvis joint at x = z = 0.
Result<std::vector<std::vector<Eigen::Vector3f>>> sample_bodies(const Sources& sources, const Survey& survey,
                                                                const BodySampleOptions& options);

struct ShapeSpace {
  Eigen::VectorXd mean;        // 3 a vertex
  Eigen::MatrixXd components;  // one a column, of one standard deviation length
  Eigen::VectorXd explained;   // share of the weighted variance, one a component
};

// Principal components of sample rows (samples x 3 vertices) by the eigenvectors of the samples' Gram matrix (Turk and
// Pentland 1991, section 2). weight: one a vertex, what its squared deviations count, so that dense regions of the mesh
// do not rule. The sign of each makes its largest entry positive.
ShapeSpace principal_components(const Eigen::MatrixXf& samples, const Eigen::VectorXd& weight, int count);

}  // namespace gyre
