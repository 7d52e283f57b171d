// SPDX-License-Identifier: Apache-2.0
// What a pipeline stage is to the runner: a function from files of the bundle to files of its own work folder.
#pragma once

#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gyre {

// What a running stage is given. It reads `bundle`, writes only into `out` (exists, empty; the runner renames it to
// work/<stage> when the stage succeeds) and returns facts worth keeping (they go to stage.json under "result").
struct StageContext {
  Bundle bundle;
  std::filesystem::path out;
  nlohmann::json options;   // the stage's defaults overlaid with the user's
  int threads = 0;          // 0: all cores
  double memory_gib = 4.0;  // what it should stay below
  std::uint64_t seed = 1;
  Progress progress = [](double, std::string_view) {};
};

// What a stage takes, as measured, for those who decide when and where it runs. It may use more cores than one exactly
// when `parallel`.
struct StageEstimate {
  bool parallel = true;
  double memory_gib = 1.0;
  double memory_gib_per_keyframe = 0.0;  // on top of that
  double core_seconds = 60.0;
  double core_seconds_per_keyframe = 1.0;
};

struct Stage {
  std::string name;
  int version = 1;                     // raised when its output changes for equal input
  std::vector<std::string> inputs;     // files or folders relative to the bundle; those that do not exist are skipped
  std::vector<std::string> external;   // options that hold paths of files whose content is an input too
  nlohmann::json options;              // every option with its default
  std::vector<std::string> published;  // files of its work folder that are also put into the bundle's root
  StageEstimate estimate;
  std::function<Result<nlohmann::json>(const StageContext&)> run;
};

}  // namespace gyre
