// SPDX-License-Identifier: Apache-2.0
// Why a pipeline ended early, for those who decide whether to try again.
#pragma once

#include "common/result/result.h"

#include <string>
#include <string_view>

namespace gyre {

enum class FailureCause {
  stage,      // the stage gave a reason: the same input ends the same way
  crash,      // its process ended without one
  memory,     // it was killed, as a rule for want of memory, or said so
  space,      // the store's disk was full
  lost,       // the machine it ran on, its time, or the word of it was lost
  cancelled,  // somebody wanted it to end
};

constexpr std::string_view name_of(FailureCause cause) {
  switch (cause) {
    case FailureCause::stage:
      return "stage";
    case FailureCause::crash:
      return "crash";
    case FailureCause::memory:
      return "memory";
    case FailureCause::space:
      return "space";
    case FailureCause::lost:
      return "lost";
    case FailureCause::cancelled:
      break;
  }
  return "cancelled";
}

struct PipelineFailure : Error {
  FailureCause cause = FailureCause::stage;
  std::string stage = {};  // empty: it did not come to one
  std::string log = {};    // the last of what the stage wrote to stderr
};

}  // namespace gyre
