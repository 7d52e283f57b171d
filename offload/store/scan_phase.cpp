// SPDX-License-Identifier: Apache-2.0
#include "offload/store/scan_phase.h"

#include <array>
#include <cstddef>

namespace gyre {

namespace {

constexpr std::array<std::string_view, 5> phase_names = {"receiving", "queued", "running", "done", "failed"};
constexpr std::array<std::string_view, 8> event_names = {"completed", "unusable", "taken",   "interrupted",
                                                         "finished",  "failed",   "retried", "delivered"};

// A device says completed again when it did not hear the answer; the scan keeps the job it has.
constexpr ScanTransition transitions[] = {
    {StorePhase::receiving, ScanEvent::completed, StorePhase::queued},
    {StorePhase::receiving, ScanEvent::unusable, StorePhase::failed},
    {StorePhase::queued, ScanEvent::completed, StorePhase::queued},
    {StorePhase::queued, ScanEvent::taken, StorePhase::running},
    {StorePhase::queued, ScanEvent::failed, StorePhase::failed},
    {StorePhase::running, ScanEvent::completed, StorePhase::running},
    {StorePhase::running, ScanEvent::interrupted, StorePhase::queued},
    {StorePhase::running, ScanEvent::finished, StorePhase::done},
    {StorePhase::running, ScanEvent::failed, StorePhase::failed},
    {StorePhase::done, ScanEvent::completed, StorePhase::done},
    {StorePhase::done, ScanEvent::delivered, StorePhase::done},
    {StorePhase::done, ScanEvent::retried, StorePhase::queued},
    {StorePhase::failed, ScanEvent::completed, StorePhase::failed},
    {StorePhase::failed, ScanEvent::retried, StorePhase::queued},
};

}  // namespace

std::span<const ScanTransition> scan_transitions() {
  return transitions;
}

std::optional<StorePhase> next_phase(StorePhase from, ScanEvent event) {
  for (const ScanTransition& t : transitions) {
    if (t.from == from && t.event == event) return t.to;
  }
  return std::nullopt;
}

std::string_view name_of(StorePhase phase) {
  return phase_names[static_cast<std::size_t>(phase)];
}
StorePhase phase_named(std::string_view name) {
  for (std::size_t i = 0; i < phase_names.size(); ++i) {
    if (phase_names[i] == name) return static_cast<StorePhase>(i);
  }
  return StorePhase::receiving;
}
std::string_view name_of(ScanEvent event) {
  return event_names[static_cast<std::size_t>(event)];
}

}  // namespace gyre
