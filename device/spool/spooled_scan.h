// SPDX-License-Identifier: Apache-2.0
// What the device knows of one scan, and the state machine of the events that change it.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// A scan on the device. Every step is on disk before it is reported; spooled_scan.cpp has the table of all steps:
//
//   recording ──closed──▶ closed ──acknowledged──▶ acknowledged ──delivered──▶ delivered
//                          ▲ └────────failed────────▶ failed ◀──failed──┤
//                          └──lost (the host has lost it)──┴────────────┘
enum class SpoolPhase { recording, closed, acknowledged, delivered, failed };

// A file of a scan: spooled (on our disk) ──▶ acknowledged (on the host's disk too); or discarded by the selection.
enum class SpooledFilePhase { spooled, acknowledged, discarded };

struct SpooledFile {
  std::string name;  // relative to the bundle: "frames/body-000012.jpg", "scan.json", "frames.jsonl"
  std::uint64_t size = 0;
  std::string sha256;
  SpooledFilePhase phase = SpooledFilePhase::spooled;
};

struct SpooledScan {
  std::string id;
  SpoolPhase phase = SpoolPhase::recording;
  std::string reason;                // why it failed
  std::vector<SpooledFile> files;    // by name, discarded ones included
  std::vector<SpooledFile> results;  // by name; what came back from the host so far
};

// Something that happened to a scan: a line of its journal.
struct SpoolEvent {
  enum class Kind {
    opened,
    file,          // name, size, sha256: written to the bundle
    discarded,     // name: dropped by the selection
    closed,        // the files that are not discarded make the bundle
    stored,        // name: on the host's disk
    lost,          // name: the host does not have it (any more)
    acknowledged,  // the host has the whole bundle
    failed,        // reason
    result,        // name, size, sha256: came back from the host
    delivered,     // all results are here
  };
  Kind kind = Kind::opened;
  std::string name;
  std::uint64_t size = 0;
  std::string sha256;
  std::string reason;
};

std::string_view name_of(SpoolPhase phase);
std::string_view name_of(SpoolEvent::Kind kind);

// Changes the scan, or leaves it alone and says why the event cannot happen in its phase or to that file.
Result<void> apply(SpooledScan& scan, const SpoolEvent& event);

// The entry of that name in a list ordered by name, or null.
const SpooledFile* find_file(const std::vector<SpooledFile>& files, std::string_view name);

}  // namespace gyre
