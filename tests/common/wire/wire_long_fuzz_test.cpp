// SPDX-License-Identifier: Apache-2.0
#include "tests/common/wire/sample_messages.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>
#include <chrono>
#include <cstdio>

namespace gyre::wire {
namespace {

TEST(WireFuzz, TenMillionMutatedMessagesNeverCrash) {
  std::vector<std::string> corpus;
  for (const Message& message : sample_messages()) corpus.push_back(encode(message));
  constexpr int rounds = 10'000'000;
  const auto start = std::chrono::steady_clock::now();
  fuzz(corpus, rounds);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%d messages, %.0f a second\n", rounds, rounds / seconds);
}

}  // namespace
}  // namespace gyre::wire
