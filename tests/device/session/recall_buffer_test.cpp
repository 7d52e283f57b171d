// SPDX-License-Identifier: Apache-2.0
#include "device/session/recall_buffer.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

Frame frame(int index, std::size_t bytes) {
  return {.index = index,
          .time = 0.1 * index,
          .image = {},
          .jpeg = std::string(bytes, 'x'),
          .full = nullptr,
          .settings = {}};
}

TEST(RecallBuffer, KeepsAllThatFits) {
  RecallBuffer buffer(1000);
  for (int i = 0; i < 10; ++i) buffer.add(frame(i, 100));
  EXPECT_EQ(buffer.bytes(), 1000U);
  EXPECT_EQ(buffer.frames_per_place(), 1);
  for (int i = 0; i < 10; ++i) ASSERT_NE(buffer.find(i), nullptr);
  EXPECT_EQ(buffer.find(10), nullptr);
  EXPECT_DOUBLE_EQ(buffer.find(7)->time, 0.7);
}

TEST(RecallBuffer, StaysWithinItsMemoryAndCoversTheWholeRecording) {
  RecallBuffer buffer(1000);
  for (int i = 0; i < 5000; ++i) {
    buffer.add(frame(i, 40 + static_cast<std::size_t>(i * 37 % 50)));
    ASSERT_LE(buffer.bytes(), 1000U);
  }
  const int places = 5000 / buffer.frames_per_place();
  EXPECT_GE(static_cast<int>(buffer.kept().size()), places);
  EXPECT_GE(places, 1000 / 90 / 2);
  int last = -buffer.frames_per_place();
  for (const RecallBuffer::Kept& kept : buffer.kept()) {
    EXPECT_LT(kept.index - last, 2 * buffer.frames_per_place());
    last = kept.index;
  }
}

TEST(RecallBuffer, OfNeighboursTheLargestStays) {
  RecallBuffer buffer(600);
  for (int i = 0; i < 64; ++i) buffer.add(frame(i, i % 8 == 5 ? 70 : 50));
  ASSERT_EQ(buffer.frames_per_place(), 8);
  for (const RecallBuffer::Kept& kept : buffer.kept()) EXPECT_EQ(kept.index % 8, 5);
}

TEST(RecallBuffer, PassesOverWhatIsNotCompressedOrTooLarge) {
  RecallBuffer buffer(100);
  buffer.add(frame(0, 0));
  buffer.add(frame(1, 101));
  EXPECT_TRUE(buffer.kept().empty());
  buffer.add(frame(2, 100));
  EXPECT_NE(buffer.find(2), nullptr);
  buffer.clear();
  EXPECT_EQ(buffer.find(2), nullptr);
  EXPECT_EQ(buffer.bytes(), 0U);
}

}  // namespace
}  // namespace gyre
