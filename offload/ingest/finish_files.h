// SPDX-License-Identifier: Apache-2.0
// Files that have arrived whole are taken to their place in the store.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "offload/store/store.h"

#include <filesystem>
#include <string>
#include <vector>

namespace gyre {

struct ArrivedFile {
  std::string scan;
  wire::FileEntry file;
  std::filesystem::path part;  // where it lies
};

struct FinishedFile {
  ArrivedFile arrived;
  Result<bool> stored;  // false: its bytes do not have its hash, and are gone. Error: the store cannot go on.
};

// All at a time: each is checked and synced, then the folders, then the catalogue; when this returns, all of that is on
// disk. Hashing and waiting for the disk are most of what a file costs.
std::vector<FinishedFile> finish_files(Store& store, std::vector<ArrivedFile> files);

}  // namespace gyre
