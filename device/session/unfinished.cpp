// SPDX-License-Identifier: Apache-2.0
#include "device/session/unfinished.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/log/utc_time.h"

#include <nlohmann/json.hpp>

namespace gyre {

namespace {

std::filesystem::path entry_of(const std::filesystem::path& spool, const std::string& request) {
  return spool / "unfinished" / (sha256(request) + ".json");
}

}  // namespace

Result<UnfinishedScan> begin_scan(const std::filesystem::path& spool, const std::string& request) {
  const std::filesystem::path entry = entry_of(spool, request);
  if (const Result<std::string> text = read_file(entry)) {
    const nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
    if (json.is_object() && json.contains("scan") && json.contains("created") && json["scan"].is_string() &&
        json["created"].is_string() && is_ulid(json["scan"].get<std::string>())) {
      return UnfinishedScan{json["scan"], json["created"], true};
    }
  }
  const UnfinishedScan scan{new_ulid(), utc_now(), false};
  std::error_code error;
  std::filesystem::create_directories(entry.parent_path(), error);
  if (error) return fail("cannot create the folder", entry.parent_path().string() + " (" + error.message() + ")");
  const nlohmann::json json = {{"scan", scan.id}, {"created", scan.created}};
  if (const Result<void> written = write_file(entry, json.dump() + "\n"); !written) {
    return tl::unexpected(written.error());
  }
  return scan;
}

void end_scan(const std::filesystem::path& spool, const std::string& request) {
  std::error_code ignored;
  std::filesystem::remove(entry_of(spool, request), ignored);
}

}  // namespace gyre
