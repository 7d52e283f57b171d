// SPDX-License-Identifier: Apache-2.0
#include "offload/store/scan_archive.h"
#include "tests/fuzz/fuzz.h"
#include "tests/temporary_folder.h"

#include <cstdlib>
#include <filesystem>

// libFuzzer's entry. Any bytes unpack to a scan or are an error, and nothing appears outside of the folder given.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace fs = std::filesystem;
  static const gyre::TemporaryFolder folder;
  const fs::path into = folder.path() / "into";
  fs::remove_all(into);
  fs::create_directories(into);
  const gyre::MemoryFile tar(data, size);
  static_cast<void>(gyre::unpack_scan(tar.path(), into, {1 << 20, 100}));
  if (std::distance(fs::directory_iterator(folder.path()), {}) != 1) std::abort();
  return 0;
}
