// SPDX-License-Identifier: Apache-2.0
// What the tests of parsers do to well-formed input. A target is libFuzzer's entry point, so that the same file serves
// a fuzzing run as well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace gyre {

// Runs the program's target over the corpus and over `rounds` mutations of it, seeded, the same each time. Mutants join
// the corpus now and then.
void fuzz(std::vector<std::string> corpus, int rounds);

// Bytes under a path, in memory, for parsers that read files.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size);
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile();

  std::filesystem::path path() const;

 private:
  int descriptor_ = -1;
};

}  // namespace gyre
