// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/notices.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using std::chrono::milliseconds;

const wire::Capabilities all = {std::string(wire::takes_status), std::string(wire::takes_coverage)};
constexpr const char* scan = "01ARZ3NDEKTSV4RRFFQ69G5FAV";

class NoticesTest : public testing::Test {
 protected:
  template <class Kind>
  std::optional<Kind> next() {
    const std::optional<wire::Message> message = notices_.next(now_);
    if (!message || !std::holds_alternative<Kind>(*message)) return std::nullopt;
    return std::get<Kind>(*message);
  }
  std::uint32_t waiting_ = 3;
  std::uint64_t room_ = 1ULL << 40;
  Notices notices_{[this](wire::DeviceStatus& status) {
    status.waiting_files = waiting_;
    status.free_bytes = room_;
  }};
  Notices::Time now_ = Notices::Time() + milliseconds(1000);
};

TEST_F(NoticesTest, AHostThatTakesNoneIsToldNothing) {
  notices_.publish({scan, "body", {}});
  EXPECT_FALSE(notices_.next(now_));
  notices_.restart({"something else"});
  EXPECT_FALSE(notices_.next(now_));
}

TEST_F(NoticesTest, AStatusIsToldWhenItChangedAndNotTooOften) {
  notices_.restart(all);
  const auto first = next<wire::DeviceStatus>();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->state, "ready");
  EXPECT_EQ(first->waiting_files, 3U);
  notices_.set("recording", "walk on", scan);
  now_ += milliseconds(100);
  EXPECT_FALSE(notices_.next(now_));
  now_ += milliseconds(500);
  EXPECT_EQ(next<wire::DeviceStatus>()->text, "walk on");
  now_ += milliseconds(500);
  room_ -= 1000;  // no news
  EXPECT_FALSE(notices_.next(now_));
  waiting_ = 2;
  now_ += milliseconds(500);
  EXPECT_EQ(next<wire::DeviceStatus>()->waiting_files, 2U);
  notices_.restart(all);
  EXPECT_EQ(next<wire::DeviceStatus>()->scan, scan);  // the next host knows nothing yet
}

TEST_F(NoticesTest, OfPreviewsOnlyTheLatestIsTold) {
  notices_.restart(all);
  EXPECT_TRUE(next<wire::DeviceStatus>());
  EXPECT_FALSE(notices_.next(now_));
  notices_.publish({scan, "body", {{"body upper", 0.1, "a"}}});
  notices_.publish({scan, "body", {{"body upper", 0.2, "ab"}}});
  EXPECT_EQ(next<wire::CoveragePreview>()->bands.at(0).cells, "ab");
  notices_.publish({scan, "body", {{"body upper", 0.3, "abc"}}});
  now_ += milliseconds(100);
  EXPECT_FALSE(notices_.next(now_));
  now_ += milliseconds(200);
  EXPECT_EQ(next<wire::CoveragePreview>()->bands.at(0).cells, "abc");
  now_ += milliseconds(1000);
  EXPECT_FALSE(notices_.next(now_));
  notices_.restart(all);
  EXPECT_TRUE(next<wire::DeviceStatus>());
  EXPECT_TRUE(next<wire::CoveragePreview>());
}

}  // namespace
}  // namespace gyre
