// SPDX-License-Identifier: Apache-2.0
// Runs the fuzz target over a corpus grown from well-formed messages by seeded mutation.
#include "tests/common/wire/sample_messages.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <cstdint>
#include <random>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace gyre::wire {
namespace {

std::string mutate(std::string bytes, const std::vector<std::string>& corpus, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random() % n); };
  for (std::size_t edits = 1 + below(6); edits > 0; --edits) {
    const std::size_t at = below(bytes.size() + 1);
    switch (below(6)) {
      case 0:
        bytes.insert(at, 1, static_cast<char>(random() & 0xff));
        break;
      case 1:
        bytes.erase(at, 1 + below(8));
        break;
      case 2:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 3:
        bytes.insert(at, corpus[below(corpus.size())]);
        break;
      case 4:
        bytes.resize(at);
        break;
      default:
        if (at < bytes.size()) bytes.insert(at, bytes.substr(at, 1 + below(64)));
        break;
    }
  }
  return bytes;
}

TEST(WireFuzz, MutatedMessagesNeverCrash) {
  std::vector<std::string> corpus = {"", std::string(1 << 10, '\0'), std::string(max_message_bytes + 1, '\x0a')};
  for (const Message& message : sample_messages()) corpus.push_back(encode(message));
  std::mt19937_64 random(7);
  for (const std::string& seed : corpus) {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(seed.data()), seed.size());
  }
  corpus.pop_back();
  corpus.erase(corpus.begin() + 2);
  for (int i = 0; i < 100'000; ++i) {
    const std::string bytes = mutate(corpus[random() % corpus.size()], corpus, random);
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    if (i % 500 == 0 && bytes.size() < 4096) corpus.push_back(bytes);
  }
}

}  // namespace
}  // namespace gyre::wire
