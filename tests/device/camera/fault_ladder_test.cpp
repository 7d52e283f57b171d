// SPDX-License-Identifier: Apache-2.0
#include "device/camera/fault_ladder.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using Step = LadderStep;

constexpr LadderOptions options{.silence = 3.0, .restarts = 2, .between_reopens = 1.0, .patience = 20.0, .calm = 5.0};

TEST(FaultLadder, DoesNothingWhileFramesCome) {
  FaultLadder ladder(options);
  ladder.started(100.0);
  for (double now = 102.0; now < 200.0; now += 2.5) {
    EXPECT_EQ(ladder.silent(now), Step::none);
    ladder.frame(now);
    EXPECT_EQ(ladder.silent(now + 2.9), Step::none);
    EXPECT_FALSE(ladder.recovering());
  }
}

TEST(FaultLadder, ClimbsWhileSilenceLasts) {
  FaultLadder ladder(options);
  ladder.started(0.0);
  EXPECT_EQ(ladder.silent(3.0), Step::restart);
  EXPECT_TRUE(ladder.recovering());
  EXPECT_EQ(ladder.silent(4.0), Step::none);
  EXPECT_EQ(ladder.silent(6.0), Step::restart);
  EXPECT_EQ(ladder.silent(9.0), Step::reopen);
  EXPECT_EQ(ladder.silent(12.0), Step::reopen);
  EXPECT_EQ(ladder.next_step(), 15.0);
  EXPECT_EQ(ladder.silent(23.0), Step::give_up);
}

TEST(FaultLadder, ErrorsClimbAtOnceButADeviceIsNotAskedTooOften) {
  FaultLadder ladder(options);
  ladder.started(0.0);
  EXPECT_EQ(ladder.failed(1.0), Step::restart);
  EXPECT_EQ(ladder.failed(1.0), Step::restart);
  EXPECT_EQ(ladder.failed(1.0), Step::reopen);
  EXPECT_EQ(ladder.failed(1.1), Step::none);
  EXPECT_EQ(ladder.silent(1.9), Step::none);
  EXPECT_EQ(ladder.silent(2.0), Step::reopen);
  EXPECT_EQ(ladder.failed(21.0), Step::give_up);
}

TEST(FaultLadder, AFrameEndsTheRecoveryButOnlyCalmEndsTheTrouble) {
  FaultLadder ladder(options);
  ladder.started(0.0);
  ASSERT_EQ(ladder.silent(3.0), Step::restart);
  ladder.frame(4.0);
  EXPECT_FALSE(ladder.recovering());
  ASSERT_EQ(ladder.silent(7.0), Step::restart);
  ladder.frame(8.0);
  EXPECT_EQ(ladder.silent(11.0), Step::reopen);
  for (double now = 12.0; now <= 17.0; now += 1.0) ladder.frame(now);
  EXPECT_EQ(ladder.silent(20.0), Step::restart);
}

TEST(FaultLadder, ChecksItsOptions) {
  EXPECT_TRUE(options.check());
  EXPECT_FALSE((LadderOptions{.silence = 0.0}.check()));
  EXPECT_FALSE((LadderOptions{.restarts = -1}.check()));
  EXPECT_FALSE((LadderOptions{.between_reopens = 0.0}.check()));
  EXPECT_FALSE((LadderOptions{.patience = 0.0}.check()));
  EXPECT_FALSE((LadderOptions{.calm = -1.0}.check()));
}

}  // namespace
}  // namespace gyre
