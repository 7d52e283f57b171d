// SPDX-License-Identifier: Apache-2.0
#include "device/spool/journal.h"

#include "common/bundle/atomic_file.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using Kind = SpoolEvent::Kind;

std::vector<SpoolEvent> some_events() {
  return {{Kind::opened, "", 0, "", ""},
          {Kind::file, "frames/body-000001.jpg", 123, std::string(64, 'a'), ""},
          {Kind::failed, "", 0, "", "a \"reason\"\nwith a line break"}};
}

void write_journal(const std::filesystem::path& file, const std::vector<SpoolEvent>& events) {
  std::vector<SpoolEvent> before;
  Result<SpoolJournal> journal = SpoolJournal::open(file, before);
  ASSERT_TRUE(journal) << journal.error().message();
  for (const SpoolEvent& event : events) ASSERT_TRUE(journal->append(event));
}

TEST(SpoolJournal, ReadsBackWhatWasAppended) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "spool.jsonl";
  write_journal(file, some_events());
  std::vector<SpoolEvent> events;
  ASSERT_TRUE(SpoolJournal::open(file, events));
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].kind, Kind::opened);
  EXPECT_EQ(events[1].name, "frames/body-000001.jpg");
  EXPECT_EQ(events[1].size, 123U);
  EXPECT_EQ(events[1].sha256, std::string(64, 'a'));
  EXPECT_EQ(events[2].reason, "a \"reason\"\nwith a line break");
}

// Whatever length a crash leaves, the whole events before are there and appending goes on after them.
TEST(SpoolJournal, SurvivesBeingCutAnywhere) {
  const TemporaryFolder folder;
  const auto whole = folder.path() / "whole";
  write_journal(whole, some_events());
  const std::string text = read_file(whole).value();
  for (std::size_t length = 0; length <= text.size(); ++length) {
    SCOPED_TRACE(length);
    const auto file = folder.path() / "cut";
    ASSERT_TRUE(write_file(file, std::string_view(text).substr(0, length)));
    const auto lines =
        static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<long>(length), '\n'));
    write_journal(file, {{Kind::closed, "", 0, "", ""}});
    std::vector<SpoolEvent> events;
    ASSERT_TRUE(SpoolJournal::open(file, events));
    ASSERT_EQ(events.size(), lines + 1);
    EXPECT_EQ(events.back().kind, Kind::closed);
  }
}

TEST(SpoolJournal, DropsALastLineOfGarbageButNotOneInTheMiddle) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "spool.jsonl";
  const std::string good = "{\"event\":\"opened\"}\n";
  for (const std::string& garbage : {std::string("{\"event\":\n"), std::string("{\"event\":\"nonsense\"}\n"),
                                     std::string(100, '\0'), std::string("[]\n"), std::string("{\"event\":3}\n")}) {
    ASSERT_TRUE(write_file(file, good + garbage));
    std::vector<SpoolEvent> events;
    ASSERT_TRUE(SpoolJournal::open(file, events));
    EXPECT_EQ(events.size(), 1U);
    EXPECT_EQ(read_file(file).value(), good);
    if (garbage.ends_with('\n')) {
      ASSERT_TRUE(write_file(file, good + garbage + good));
      EXPECT_FALSE(SpoolJournal::open(file, events));
    }
  }
}

}  // namespace
}  // namespace gyre
