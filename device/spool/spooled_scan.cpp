// SPDX-License-Identifier: Apache-2.0
#include "device/spool/spooled_scan.h"

#include <algorithm>
#include <array>
#include <optional>

namespace gyre {

namespace {

using Kind = SpoolEvent::Kind;

constexpr std::array<std::string_view, 5> phase_names = {"recording", "closed", "acknowledged", "delivered", "failed"};
constexpr std::array<std::string_view, 10> kind_names = {"opened", "file",         "discarded", "closed", "stored",
                                                         "lost",   "acknowledged", "failed",    "result", "delivered"};

struct Transition {
  SpoolPhase from;
  Kind event;
  SpoolPhase to;
};

// Every event that may happen in a phase; any other is refused. A host that lost its disk sends a scan back to closed,
// one that tries a failed scan again sends it back to acknowledged.
constexpr Transition transitions[] = {
    {SpoolPhase::recording, Kind::file, SpoolPhase::recording},
    {SpoolPhase::recording, Kind::discarded, SpoolPhase::recording},
    {SpoolPhase::recording, Kind::stored, SpoolPhase::recording},
    {SpoolPhase::recording, Kind::lost, SpoolPhase::recording},
    {SpoolPhase::recording, Kind::closed, SpoolPhase::closed},
    {SpoolPhase::closed, Kind::stored, SpoolPhase::closed},
    {SpoolPhase::closed, Kind::lost, SpoolPhase::closed},
    {SpoolPhase::closed, Kind::acknowledged, SpoolPhase::acknowledged},
    {SpoolPhase::closed, Kind::failed, SpoolPhase::failed},
    {SpoolPhase::acknowledged, Kind::lost, SpoolPhase::closed},
    {SpoolPhase::acknowledged, Kind::failed, SpoolPhase::failed},
    {SpoolPhase::acknowledged, Kind::result, SpoolPhase::acknowledged},
    {SpoolPhase::acknowledged, Kind::delivered, SpoolPhase::delivered},
    {SpoolPhase::failed, Kind::lost, SpoolPhase::closed},
    {SpoolPhase::failed, Kind::acknowledged, SpoolPhase::acknowledged},
};

std::optional<SpoolPhase> next_phase(SpoolPhase from, Kind event) {
  for (const Transition& t : transitions) {
    if (t.from == from && t.event == event) return t.to;
  }
  return std::nullopt;
}

std::vector<SpooledFile>::iterator position(std::vector<SpooledFile>& files, std::string_view name) {
  return std::lower_bound(files.begin(), files.end(), name,
                          [](const SpooledFile& file, std::string_view n) { return file.name < n; });
}

void put(std::vector<SpooledFile>& files, SpooledFile file) {
  const auto at = position(files, file.name);
  if (at != files.end() && at->name == file.name) {
    *at = std::move(file);
  } else {
    files.insert(at, std::move(file));
  }
}

}  // namespace

std::string_view name_of(SpoolPhase phase) {
  return phase_names[static_cast<std::size_t>(phase)];
}
std::string_view name_of(SpoolEvent::Kind kind) {
  return kind_names[static_cast<std::size_t>(kind)];
}

const SpooledFile* find_file(const std::vector<SpooledFile>& files, std::string_view name) {
  const auto at = std::lower_bound(files.begin(), files.end(), name,
                                   [](const SpooledFile& file, std::string_view n) { return file.name < n; });
  return at != files.end() && at->name == name ? &*at : nullptr;
}

Result<void> apply(SpooledScan& scan, const SpoolEvent& event) {
  const std::optional<SpoolPhase> next = next_phase(scan.phase, event.kind);
  if (!next) {
    return fail(
        "the scan is " + std::string(name_of(scan.phase)) + " and cannot become " + std::string(name_of(event.kind)),
        scan.id);
  }
  switch (event.kind) {
    case Kind::file:
      put(scan.files, {event.name, event.size, event.sha256, SpooledFilePhase::spooled});
      break;
    case Kind::result:
      put(scan.results, {event.name, event.size, event.sha256, SpooledFilePhase::acknowledged});
      break;
    case Kind::discarded:
    case Kind::stored:
    case Kind::lost: {
      const auto file = position(scan.files, event.name);
      if (file == scan.files.end() || file->name != event.name) {
        return fail("the scan has no such file", scan.id + "/" + event.name);
      }
      if (event.kind == Kind::discarded) {
        file->phase = SpooledFilePhase::discarded;
      } else if (file->phase != SpooledFilePhase::discarded) {
        file->phase = event.kind == Kind::stored ? SpooledFilePhase::acknowledged : SpooledFilePhase::spooled;
      }
      break;
    }
    case Kind::failed:
      scan.reason = event.reason;
      break;
    case Kind::acknowledged:
      scan.reason.clear();
      break;
    case Kind::opened:
    case Kind::closed:
    case Kind::delivered:
      break;
  }
  scan.phase = *next;
  return {};
}

}  // namespace gyre
