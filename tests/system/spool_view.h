// SPDX-License-Identifier: Apache-2.0
// A device's spool seen from outside, also while its owner runs or after that was torn out of its work; and what has to
// hold for it then.
#pragma once

#include "device/session/session_store.h"
#include "device/spool/spooled_scan.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace gyre {

struct SpoolView {
  std::map<std::string, SpooledScan> scans;  // by id
  std::optional<StoredSession> session;

  // Hash by scan and name of the keyframes that were spooled and not taken back, and of those of them the host has.
  using Files = std::map<std::string, std::string>;
  Files keyframes() const;
  Files acknowledged() const;
};

// Changes nothing there.
SpoolView view_spool(const std::filesystem::path& spool);

// Every keyframe that a view speaks of is there whole.
void expect_whole(const SpoolView::Files& keyframes, const std::filesystem::path& scans);

// After a start: nothing is in the spool but what its journals speak of, and that is whole; no scan is left open that
// the session does not know of.
void expect_tidy(const SpoolView& view, const std::filesystem::path& spool);

// The start between these views took nothing away but a pass with too few keyframes, and `log` says what it found and
// what became of it.
void expect_explained(const SpoolView& before, const SpoolView& after, const std::string& log);

// Every scan that was closed is at the host, whole and the same, and its results are back. acknowledged: all that the
// host was ever known to have; of it only what was taken back since is gone. Returns how many scans there are.
int expect_delivered(const SpoolView& view, const SpoolView::Files& acknowledged, const std::filesystem::path& scans);

}  // namespace gyre
