// SPDX-License-Identifier: Apache-2.0
// COLMAP, where it is installed, on the same pictures: the baseline of the cameras bench.
#pragma once

#include "common/geometry/colmap_model.h"
#include "common/result/result.h"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace gyre::bench {

struct ColmapRun {
  ColmapModel model;                                 // the largest it made
  double extraction = 0, matching = 0, mapping = 0;  // CPU seconds

  double cpu() const { return extraction + matching + mapping; }
};

bool colmap_is_installed();

// One camera, no GPU, everything else as COLMAP has it; matches all pairs when `pairs` is empty. `work` is emptied
// first and holds COLMAP's database, models and log afterwards. Error when a step fails or no model comes out.
Result<ColmapRun> run_colmap(const std::filesystem::path& pictures,
                             const std::vector<std::pair<std::string, std::string>>& pairs,
                             const std::filesystem::path& work);

}  // namespace gyre::bench
