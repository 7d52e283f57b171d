// SPDX-License-Identifier: Apache-2.0
#include "device/session/kept_selection.h"

#include <gtest/gtest.h>
#include <random>
#include <set>
#include <vector>

namespace gyre {
namespace {

std::vector<FrameMeasure> walk_of(int frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> motion(1.0, 3.0);
  std::uniform_real_distribution<double> sharpness(50.0, 150.0);
  std::vector<FrameMeasure> measures;
  for (int i = 0; i < frames; ++i) measures.push_back({i == 0 ? 0.0 : motion(random), sharpness(random)});
  return measures;
}

TEST(KeptSelection, WithEverythingKeptItIsTheExactRule) {
  const std::vector<FrameMeasure> frames = walk_of(600, 1);
  const SelectionOptions options;
  const Result<Selection> exact = select_keyframes(frames, options);
  const Result<Selection> kept = select_among_kept(
      frames, [](int) { return true; }, options);
  ASSERT_TRUE(exact && kept);
  EXPECT_EQ(kept->keyframes, exact->keyframes);
  EXPECT_NEAR(kept->widest_gap, exact->widest_gap, 1e-9);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(kept->decisions[i].reason, exact->decisions[i].reason);
}

// Every eighth frame was kept: at the paper's rates no gap exceeds one and a half T.
TEST(KeptSelection, ChoosesOnlyKeptFramesWithoutLongGaps) {
  const std::vector<FrameMeasure> frames = walk_of(2400, 2);
  const auto is_kept = [](int i) { return i % 8 == 3; };
  const Result<Selection> selection = select_among_kept(frames, is_kept, {});
  ASSERT_TRUE(selection);
  EXPECT_GE(selection->keyframes.size(), 74U);
  EXPECT_LE(selection->widest_gap, 1.5);
  int last = -1;
  for (const int i : selection->keyframes) {
    EXPECT_TRUE(is_kept(i)) << i;
    EXPECT_GT(i, last);
    last = i;
    EXPECT_TRUE(selection->decisions[static_cast<std::size_t>(i)].keyframe);
  }
  const auto chosen = std::count_if(selection->decisions.begin(), selection->decisions.end(),
                                    [](const FrameDecision& decision) { return decision.keyframe; });
  EXPECT_EQ(static_cast<std::size_t>(chosen), selection->keyframes.size());
}

TEST(KeptSelection, OfAnyKeptSetItMakesAWholeSelection) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::vector<FrameMeasure> frames = walk_of(60 + static_cast<int>(random() % 300), seed);
    std::set<int> kept;
    const unsigned one_in = 1 + random() % 30;
    for (int i = 0; i < static_cast<int>(frames.size()); ++i) {
      if (random() % one_in == 0) kept.insert(i);
    }
    const Result<Selection> selection = select_among_kept(frames, [&](int i) { return kept.contains(i); }, {});
    if (kept.empty()) continue;
    ASSERT_TRUE(selection);
    std::set<int> chosen;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_FALSE(selection->decisions[i].reason.empty());
      if (selection->decisions[i].keyframe) chosen.insert(static_cast<int>(i));
    }
    EXPECT_EQ(chosen, std::set<int>(selection->keyframes.begin(), selection->keyframes.end()));
    for (const int i : chosen) EXPECT_TRUE(kept.contains(i));
  }
}

TEST(KeptSelection, NothingKeptIsAnError) {
  const Result<Selection> nothing = select_among_kept(walk_of(100, 3), [](int) { return false; }, {});
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().what, "no frame was kept");
  EXPECT_FALSE(select_among_kept(walk_of(5, 3), [](int) { return true; }, {}));
}

}  // namespace
}  // namespace gyre
