// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/needs.h"

#include <filesystem>
#include <iterator>
#include <system_error>

namespace gyre {

StageNeeds needs_of(const Stage& stage, const Bundle& bundle) {
  std::error_code error;
  const auto files = std::filesystem::directory_iterator(bundle.frames(), error);
  const auto keyframes =
      error ? 0.0 : static_cast<double>(std::distance(begin(files), std::filesystem::directory_iterator()));
  const StageEstimate& one = stage.estimate;
  return {one.parallel, one.memory_gib + keyframes * one.memory_gib_per_keyframe,
          one.core_seconds + keyframes * one.core_seconds_per_keyframe};
}

}  // namespace gyre
