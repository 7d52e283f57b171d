// SPDX-License-Identifier: Apache-2.0
#include "tests/common/wire/sample_messages.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

namespace gyre::wire {
namespace {

TEST(WireFuzz, MutatedMessagesNeverCrash) {
  std::vector<std::string> corpus = {"", std::string(max_message_bytes + 1, '\x0a')};
  for (const Message& message : sample_messages()) corpus.push_back(encode(message));
  fuzz(corpus, 100'000);
}

}  // namespace
}  // namespace gyre::wire
