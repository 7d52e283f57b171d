// SPDX-License-Identifier: Apache-2.0
// The human of the sources shaped after the people of a survey.
#pragma once

#include "offload/body/ansur.h"
#include "offload/body/makehuman.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

struct SurveyBodyOptions {
  int count = 600;         // half of each sex
  bool held_out = false;   // true: of the tenth of the people that is otherwise never used
  std::uint64_t seed = 1;  // of the choice of people
  int threads = 0;
};

struct SurveyBodies {
  // Vertices of the base mesh (helpers included), metres. Soles on y = 0, pelvis joint at x = z = 0.
  std::vector<std::vector<Eigen::Vector3f>> bodies;
  std::vector<bool> male;  // one a body
  Measures error{};        // root mean square of what the bodies miss of their people's measures, metres
};

// Bodies of people drawn from the survey without repetition. Each is the most probable one for the person's sex, age
// and measures: macro parameters and local measure targets with Gaussian priors, by Levenberg-Marquardt (Marquardt
// 1963) with difference quotients. Measures that tape and mesh define alike count as they are; of the others (flexed
// muscles, lengths between landmarks under the skin) it is the ratio to the mean of the sex. An error says that too
// many people are out of reach, or what the sources lack.
Result<SurveyBodies> fit_survey_bodies(const Sources& sources, const Survey& survey, const SurveyBodyOptions& options);

}  // namespace gyre
