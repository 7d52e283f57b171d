// SPDX-License-Identifier: Apache-2.0
// A scan as one tar file: everything of its bundle, and what the catalogue knew of it.
#pragma once

#include "offload/store/store.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace gyre {

// What is kept of a scan's row besides the files themselves.
struct ArchivedScan {
  StoredScan scan;
  std::vector<StoredFile> files, results;
};

// Bounds of what a tar from elsewhere may hold.
struct ArchiveLimits {
  std::uint64_t max_bytes = 64ULL << 30;  // of all files together
  std::size_t max_files = 100'000;
};

// Writes <scan-id>/scan.archive.json and <scan-id>/bundle/..., durably and under its name only when it is whole. Hidden
// files (of runs that were cut short) are left out.
Result<void> pack_scan(const ArchivedScan& scan, const Bundle& bundle, const std::filesystem::path& tar);

// Unpacks such a tar, uncompressed, below `into` (exists, empty) and checks every file against its hash. Whatever the
// tar is, nothing is written outside of `into`: names that lead elsewhere, links, devices, files named twice and more
// than the limits allow are errors.
Result<ArchivedScan> unpack_scan(const std::filesystem::path& tar, const std::filesystem::path& into,
                                 const ArchiveLimits& limits = {});

}  // namespace gyre
