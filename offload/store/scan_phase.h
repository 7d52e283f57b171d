// SPDX-License-Identifier: Apache-2.0
// The states of a scan on the host, and what leads from one to another.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace gyre {

// The last four are those of its job.
enum class StorePhase { receiving, queued, running, done, failed };

enum class ScanEvent {
  completed,    // every file of the manifest is here and the bundle is usable: its job is queued
  unusable,     // every file is here, and they are no bundle
  taken,        // a runner works on the job
  interrupted,  // the runner went away without a word
  finished,     // the results are in the bundle
  failed,       // the job will not succeed, or was cancelled
  retried,      // somebody wants it worked on again
  delivered,    // the device has the results
};

struct ScanTransition {
  StorePhase from;
  ScanEvent event;
  StorePhase to;
};

// All that may happen; anything else is refused and changes nothing.
std::span<const ScanTransition> scan_transitions();

std::optional<StorePhase> next_phase(StorePhase from, ScanEvent event);

std::string_view name_of(StorePhase phase);
// The phase of that name; `receiving` when there is none.
StorePhase phase_named(std::string_view name);
std::string_view name_of(ScanEvent event);

}  // namespace gyre
