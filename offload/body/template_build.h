// SPDX-License-Identifier: Apache-2.0
// Makes the packed template from the template sources.
#pragma once

#include "common/log/log.h"
#include "offload/body/survey_bodies.h"
#include "offload/body/template.h"

#include <filesystem>

namespace gyre {

struct TemplateBuildOptions {
  int components = 30;  // of the shape space, 1 to 30
  int head_modes = 40;  // of the head space, 1 to 100
  SurveyBodyOptions bodies;
  Progress progress;  // may be empty

  Result<void> check() const;
};

// The hm08 human with the 55 humanoid bones, the 52 ARKit expressions, 15 visemes, eyes, teeth, tongue and
// lashes, a shape space of adults fitted to ANSUR II, and the head space of the ICT face model. Rest pose as the base
// mesh stands (arms down and forward), soles on y = 0. An error names the source file and what is wrong with it. The
// joints' errors go to the log.
Result<BodyTemplate> build_template(const std::filesystem::path& sources, const TemplateBuildOptions& options = {});

// The humanoid joints of a body of the sources (all base vertices), in the order of humanoid_bones(): what the
// template's regressors are fitted to. The sources must have been good enough for build_template().
std::vector<Eigen::Vector3d> source_joints(const Sources& sources, const std::vector<Eigen::Vector3f>& base);

}  // namespace gyre
