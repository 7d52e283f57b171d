// SPDX-License-Identifier: Apache-2.0
#include "common/http/event_stream.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(EventStream, GreetsAndThenTells) {
  EventStream events;
  events.publish("scan", "before");
  const auto one = events.watch([] { return format_event("hello", "{}"); });
  const auto other = events.watch([] { return format_event("hello", "{}"); });
  events.publish("scan", "1");
  events.publish("scan", "2");
  for (const auto& source : {one.get(), other.get()}) {
    std::string text;
    EXPECT_TRUE(source->next(text));
    EXPECT_EQ(text, "event: hello\ndata: {}\n\nevent: scan\ndata: 1\n\nevent: scan\ndata: 2\n\n");
  }
}

TEST(EventStream, WritesSomethingWhenNothingHappens) {
  EventStream events;
  const auto source = events.watch([] { return std::string(); });
  std::string text;
  EXPECT_TRUE(source->next(text));
  text.clear();
  EXPECT_TRUE(source->next(text));
  EXPECT_TRUE(text.starts_with(":"));
}

TEST(EventStream, LetsGoWhoDoesNotRead) {
  EventStream events;
  const auto sleeper = events.watch([] { return std::string(); });
  const auto reader = events.watch([] { return std::string(); });
  std::string text;
  for (int i = 0; i < 2000; ++i) {
    events.publish("tick", std::to_string(i));
    text.clear();
    ASSERT_TRUE(reader->next(text));
  }
  EXPECT_FALSE(sleeper->next(text));
}

}  // namespace
}  // namespace gyre
