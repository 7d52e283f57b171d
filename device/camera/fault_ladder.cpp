// SPDX-License-Identifier: Apache-2.0
#include "device/camera/fault_ladder.h"

#include <string>

namespace gyre {

Result<void> LadderOptions::check() const {
  if (!(silence > 0.0)) return wrong_use("the silence must be positive", std::to_string(silence));
  if (restarts < 0) return wrong_use("restarts cannot be negative", std::to_string(restarts));
  if (!(between_reopens > 0.0)) return wrong_use("reopenings need time between them", std::to_string(between_reopens));
  if (!(patience > 0.0)) return wrong_use("the patience must be positive", std::to_string(patience));
  if (!(calm >= 0.0)) return wrong_use("the calm cannot be negative", std::to_string(calm));
  return {};
}

void FaultLadder::started(double now) {
  quiet_since_ = now;
  trouble_ = false;
  recovering_ = false;
}

void FaultLadder::frame(double now) {
  quiet_since_ = now;
  if (!trouble_) return;
  if (recovering_) frames_since_ = now;
  recovering_ = false;
  if (now - frames_since_ >= options_.calm) trouble_ = false;
}

LadderStep FaultLadder::silent(double now) {
  return now < next_step() ? LadderStep::none : escalate(now);
}

LadderStep FaultLadder::failed(double now) {
  // The device that could not be opened is not asked again at once.
  if (recovering_ && reopens_ > 0 && now < reopened_ + options_.between_reopens) {
    if (now - trouble_since_ >= options_.patience) return LadderStep::give_up;
    quiet_since_ = reopened_ + options_.between_reopens - options_.silence;
    return LadderStep::none;
  }
  return escalate(now);
}

double FaultLadder::next_step() const {
  return quiet_since_ + options_.silence;
}

LadderStep FaultLadder::escalate(double now) {
  if (!trouble_) {
    trouble_ = true;
    trouble_since_ = now;
    restarts_ = 0;
    reopens_ = 0;
  }
  recovering_ = true;
  quiet_since_ = now;
  if (now - trouble_since_ >= options_.patience) return LadderStep::give_up;
  if (restarts_ < options_.restarts) {
    ++restarts_;
    return LadderStep::restart;
  }
  ++reopens_;
  reopened_ = now;
  return LadderStep::reopen;
}

}  // namespace gyre
