// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz.h"

#include <sys/mman.h>
#include <unistd.h>
#include <random>
#include <system_error>

namespace gyre {

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

}  // namespace

void fuzz(std::vector<std::string> corpus, int rounds) {
  const auto run = [](const std::string& bytes) {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  };
  for (const std::string& seed : corpus) run(seed);
  std::erase_if(corpus, [](const std::string& seed) { return seed.size() > 65536; });
  std::mt19937_64 random(7);
  for (int i = 0; i < rounds; ++i) {
    const std::string bytes = mutate(corpus[random() % corpus.size()], corpus, random);
    run(bytes);
    if (i % 500 == 0 && bytes.size() < 4096) corpus.push_back(bytes);
  }
}

MemoryFile::MemoryFile(const std::uint8_t* data, std::size_t size) : descriptor_(::memfd_create("fuzz", MFD_CLOEXEC)) {
  if (descriptor_ < 0 || ::write(descriptor_, data, size) != static_cast<ssize_t>(size))
    throw std::system_error(errno, std::generic_category(), "no file in memory");
}

MemoryFile::~MemoryFile() {
  ::close(descriptor_);
}

std::filesystem::path MemoryFile::path() const {
  return "/proc/self/fd/" + std::to_string(descriptor_);
}

}  // namespace gyre
