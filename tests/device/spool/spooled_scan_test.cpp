// SPDX-License-Identifier: Apache-2.0
#include "device/spool/spooled_scan.h"

#include <gtest/gtest.h>
#include <map>

namespace gyre {
namespace {

using Kind = SpoolEvent::Kind;
using Phase = SpoolPhase;

SpooledScan scan_in(Phase phase) {
  SpooledScan scan;
  scan.id = "scan";
  scan.phase = phase;
  scan.files = {{"a", 1, "hash-a", SpooledFilePhase::spooled}, {"b", 2, "hash-b", SpooledFilePhase::acknowledged}};
  return scan;
}

// Walks all pairs of phase and event: the ones named here change the scan as they say, every other one is refused.
TEST(SpooledScan, AllowsExactlyTheDocumentedTransitions) {
  const std::map<std::pair<Phase, Kind>, Phase> allowed = {
      {{Phase::recording, Kind::file}, Phase::recording},
      {{Phase::recording, Kind::discarded}, Phase::recording},
      {{Phase::recording, Kind::stored}, Phase::recording},
      {{Phase::recording, Kind::lost}, Phase::recording},
      {{Phase::recording, Kind::closed}, Phase::closed},
      {{Phase::closed, Kind::stored}, Phase::closed},
      {{Phase::closed, Kind::lost}, Phase::closed},
      {{Phase::closed, Kind::acknowledged}, Phase::acknowledged},
      {{Phase::closed, Kind::failed}, Phase::failed},
      {{Phase::acknowledged, Kind::lost}, Phase::closed},
      {{Phase::acknowledged, Kind::failed}, Phase::failed},
      {{Phase::acknowledged, Kind::result}, Phase::acknowledged},
      {{Phase::acknowledged, Kind::delivered}, Phase::delivered},
      {{Phase::failed, Kind::lost}, Phase::closed},
      {{Phase::failed, Kind::acknowledged}, Phase::acknowledged},
  };
  for (int p = 0; p <= static_cast<int>(Phase::failed); ++p) {
    for (int k = 0; k <= static_cast<int>(Kind::delivered); ++k) {
      const auto phase = static_cast<Phase>(p);
      const auto kind = static_cast<Kind>(k);
      SCOPED_TRACE(std::string(name_of(phase)) + " + " + std::string(name_of(kind)));
      SpooledScan scan = scan_in(phase);
      const Result<void> done = apply(scan, {kind, "a", 1, "hash-a", "reason"});
      const auto expected = allowed.find({phase, kind});
      EXPECT_EQ(done.has_value(), expected != allowed.end());
      EXPECT_EQ(scan.phase, expected != allowed.end() ? expected->second : phase);
    }
  }
}

TEST(SpooledScan, EventsChangeTheirFile) {
  SpooledScan scan = scan_in(Phase::recording);
  ASSERT_TRUE(apply(scan, {Kind::stored, "a", 0, "", ""}));
  EXPECT_EQ(find_file(scan.files, "a")->phase, SpooledFilePhase::acknowledged);
  ASSERT_TRUE(apply(scan, {Kind::lost, "a", 0, "", ""}));
  EXPECT_EQ(find_file(scan.files, "a")->phase, SpooledFilePhase::spooled);
  ASSERT_TRUE(apply(scan, {Kind::discarded, "a", 0, "", ""}));
  ASSERT_TRUE(apply(scan, {Kind::stored, "a", 0, "", ""}));  // an acknowledgement that came too late
  EXPECT_EQ(find_file(scan.files, "a")->phase, SpooledFilePhase::discarded);
  ASSERT_TRUE(apply(scan, {Kind::file, "aa", 7, "hash-aa", ""}));
  ASSERT_EQ(scan.files.size(), 3U);
  EXPECT_EQ(scan.files[1].name, "aa");
  EXPECT_FALSE(apply(scan, {Kind::stored, "nowhere", 0, "", ""}));
}

}  // namespace
}  // namespace gyre
