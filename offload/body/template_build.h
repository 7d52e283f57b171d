// SPDX-License-Identifier: Apache-2.0
// Makes the packed template from the template sources.
#pragma once

#include "common/log/log.h"
#include "offload/body/shape_space.h"
#include "offload/body/template.h"

#include <filesystem>

namespace gyre {

struct TemplateBuildOptions {
  int components = 24;  // of the shape space, 1 to 30
  BodySampleOptions samples;
  Progress progress;  // may be empty

  Result<void> check() const;
};

// The hm08 human with the 55 humanoid bones, the 52 ARKit expressions, eyes, teeth, tongue and lashes, and a shape
// space of adults like those of ANSUR II. Rest pose as the base mesh stands (arms down and forward), soles on y = 0. An
// error names the source file and what is wrong with it. The joints' errors go to the log.
Result<BodyTemplate> build_template(const std::filesystem::path& sources, const TemplateBuildOptions& options = {});

}  // namespace gyre
