// SPDX-License-Identifier: Apache-2.0
// What the device tells the host of itself: small, only the latest of each counts, and before any bulk.
#pragma once

#include "common/wire/wire.h"

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

namespace gyre {

// set() and publish() may be called from any thread, next() and restart() from that of the conversation.
class Notices {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // fill: completes a status with what changes by itself (room, what waits).
  explicit Notices(std::function<void(wire::DeviceStatus&)> fill) : fill_(std::move(fill)) {}

  // What the device does: a word, a sentence for the operator, the scan it records (empty: none).
  void set(std::string state, std::string text, std::string scan);
  void publish(wire::CoveragePreview preview);

  // A new conversation: what the last one was told counts for nothing. capabilities: of the host.
  void restart(const wire::Capabilities& capabilities);

  // What the host should be told now, if anything: a status when it has changed, a preview when there is a new one,
  // both a few times a second at most.
  std::optional<wire::Message> next(Time now);

 private:
  std::function<void(wire::DeviceStatus&)> fill_;
  bool takes_status_ = false;
  bool takes_coverage_ = false;
  std::optional<wire::DeviceStatus> told_;  // in this conversation
  std::optional<Time> looked_;              // for a change of the status
  std::optional<Time> previewed_;
  std::mutex mutex_;  // guards what follows
  wire::DeviceStatus status_{.state = "ready"};
  std::optional<wire::CoveragePreview> preview_;  // the latest
  bool preview_is_new_ = false;
};

}  // namespace gyre
