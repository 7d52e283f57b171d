// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/finish_files.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"

#include <set>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// Checks and syncs what has arrived; false when it is not what it should be.
Result<bool> check(const ArrivedFile& arrived) {
  const Result<std::string> hash = sha256_of_file(arrived.part);
  if (!hash) return tl::unexpected(hash.error());
  if (*hash != arrived.file.sha256) {
    std::error_code error;
    fs::remove(arrived.part, error);
    return false;
  }
  if (Result<void> synced = sync_path(arrived.part); !synced) return tl::unexpected(synced.error());
  return true;
}

Result<void> move_file(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return {};
  return fail("cannot move a file", from.string() + " (" + error.message() + ")");
}

}  // namespace

std::vector<FinishedFile> finish_files(Store& store, std::vector<ArrivedFile> files) {
  std::vector<FinishedFile> done;
  for (ArrivedFile& file : files) {
    Result<bool> good = check(file);
    done.push_back({std::move(file), std::move(good)});
  }
  const auto each_good = [&](const auto& work) {
    for (FinishedFile& one : done) {
      if (!one.stored || !*one.stored) continue;
      if (Result<void> worked = work(one.arrived); !worked) one.stored = tl::unexpected(worked.error());
    }
  };
  const auto place_of = [&](const ArrivedFile& file) { return store.bundle(file.scan).root() / file.file.name; };
  each_good([&](const ArrivedFile& file) { return move_file(file.part, place_of(file)); });
  std::set<fs::path> synced;
  each_good([&](const ArrivedFile& file) {
    const fs::path folder = place_of(file).parent_path();
    return synced.insert(folder).second ? sync_path(folder) : Result<void>();
  });
  std::vector<std::pair<std::string, StoredFile>> entries;
  each_good([&](const ArrivedFile& file) {
    entries.push_back({file.scan, {file.file.name, file.file.size, file.file.sha256}});
    return Result<void>();
  });
  if (Result<void> added = store.add_files(entries); !added) {
    each_good([&](const ArrivedFile&) { return added; });
  }
  return done;
}

}  // namespace gyre
