// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/pacer.h"

#include "common/wire/wire.h"

#include <gtest/gtest.h>
#include <deque>

namespace gyre {
namespace {

using std::chrono::milliseconds;

constexpr std::uint64_t chunk = wire::cost_of(wire::max_chunk_bytes);

// A line of so many bytes a second and that delay, with a host that takes at once and grants what it took.
class Line {
 public:
  Line(Pacer& pacer, double rate, milliseconds delay, std::uint64_t credit)
      : pacer_(pacer), rate_(rate), delay_(delay) {
    pacer_.grant(credit, now_);
  }

  void run(milliseconds duration) {
    for (const Pacer::Time end = now_ + duration; now_ < end; now_ += milliseconds(1)) {
      for (; !grants_.empty() && grants_.front().first <= now_; grants_.pop_front()) {
        pacer_.grant(grants_.front().second, now_);
        taken_ += grants_.front().second;
      }
      while (pacer_.may_send(chunk, now_)) {
        pacer_.sent(chunk, now_);
        free_ = std::max(free_, now_) + milliseconds(static_cast<long>(1000.0 * chunk / rate_));
        grants_.emplace_back(free_ + delay_, chunk);
      }
      longest_queue_ = std::max(longest_queue_, free_ - now_);
    }
  }
  double taken() const { return static_cast<double>(taken_); }
  milliseconds longest_queue() const { return std::chrono::duration_cast<milliseconds>(longest_queue_); }
  // Nothing is sent.
  void pause(milliseconds duration) {
    now_ += duration;
    for (; !grants_.empty(); grants_.pop_front()) pacer_.grant(grants_.front().second, now_);
    taken_ = 0;
  }

 private:
  Pacer& pacer_;
  double rate_;
  milliseconds delay_;  // there and back
  Pacer::Time now_{std::chrono::hours(1)};
  Pacer::Time free_ = now_;  // when all that was sent is through
  std::deque<std::pair<Pacer::Time, std::uint64_t>> grants_;
  std::uint64_t taken_ = 0;
  Pacer::Time::duration longest_queue_{};
};

TEST(Pacer, FillsALineAndKeepsItsQueueShort) {
  for (const double rate : {2.5e6, 12.5e6, 125e6}) {
    for (const int delay_ms : {1, 50, 200}) {
      Pacer pacer;
      Line line(pacer, rate, milliseconds(delay_ms), 1ULL << 32);
      line.run(std::chrono::seconds(10));
      EXPECT_GT(line.taken(), 0.9 * 10.0 * rate) << rate << " bytes/s, " << delay_ms << " ms";
      EXPECT_LE(line.longest_queue(), milliseconds(560)) << rate << " bytes/s, " << delay_ms << " ms";
    }
  }
}

TEST(Pacer, GrowsAgainAfterAPause) {
  Pacer pacer;
  Line line(pacer, 12.5e6, milliseconds(50), 1ULL << 32);
  line.run(std::chrono::seconds(2));
  line.pause(std::chrono::minutes(1));
  line.run(std::chrono::seconds(2));
  EXPECT_GT(line.taken(), 0.8 * 2.0 * 12.5e6);
}

TEST(Pacer, CreditIsAHardLimit) {
  Pacer pacer;
  const Pacer::Time now(std::chrono::hours(1));
  pacer.grant(2 * chunk, now);
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(pacer.may_send(chunk, now));
    pacer.sent(chunk, now);
  }
  EXPECT_FALSE(pacer.may_send(1, now));
  EXPECT_EQ(pacer.wait(now).count(), 0);  // it is not the operator's limit that stands in the way
}

TEST(Pacer, KeepsTheOperatorsLimit) {
  constexpr double limit = 1e6;
  Pacer pacer(limit);
  Line line(pacer, 125e6, milliseconds(10), 1ULL << 32);
  line.run(std::chrono::seconds(20));
  EXPECT_NEAR(line.taken(), 20.0 * limit, 2.0 * chunk);
}

TEST(Pacer, SaysWhenTheLimitAllowsMore) {
  Pacer pacer(1e6);
  const Pacer::Time now(std::chrono::hours(1));
  pacer.grant(1 << 24, now);
  ASSERT_TRUE(pacer.may_send(chunk, now));
  pacer.sent(chunk, now);
  ASSERT_FALSE(pacer.may_send(chunk, now));
  const milliseconds wait = pacer.wait(now);
  EXPECT_FALSE(pacer.may_send(chunk, now + wait - milliseconds(2)));
  EXPECT_TRUE(pacer.may_send(chunk, now + wait));
  EXPECT_EQ(pacer.wait(now + wait).count(), 0);
}

}  // namespace
}  // namespace gyre
