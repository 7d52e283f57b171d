// SPDX-License-Identifier: Apache-2.0
// Recordings that browsers send: they lie in <store>/uploads/<id>/ until they are a scan of that id.
#pragma once

#include "common/result/result.h"
#include "offload/ingest/recording.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

struct Upload {
  std::string id;       // ULID
  std::string created;  // ISO 8601, UTC
  std::optional<double> height_mm;
  std::vector<Recording> recordings;
};

// Different uploads may be used from different threads at once, one upload from one.
class UploadDesk {
 public:
  // reserve_bytes: what an upload leaves free on the disk.
  UploadDesk(std::filesystem::path folder, std::uint64_t reserve_bytes)
      : folder_(std::move(folder)), reserve_bytes_(reserve_bytes) {}

  // Makes place for an upload of that many bytes and returns its id. Uploads that nobody finished for a day go.
  // Errors: no room.
  Result<std::string> begin(std::uint64_t bytes);

  // Takes the recording of a pass ("body", "head" or "turn"), in place of one sent before. kind: what its file name
  // ends in, as "mp4". `read` hands over its bytes, see HttpServer::Reader. It is on disk, whole, when this returns.
  using Reader = std::function<bool(const std::function<bool(std::string_view)>&)>;
  Result<void> take(const std::string& id, const std::string& pass, const std::string& kind, const Reader& read);

  // Everything was sent: from now on the upload survives a restart. Errors: there is no body or turn pass.
  Result<void> finish(const std::string& id, std::optional<double> height_mm);

  // Removes an upload with all its files; one that is not there is fine.
  void remove(const std::string& id) const;

  // The finished ones, oldest first. Those that were cut short by a restart are removed when `remove_rest`.
  std::vector<Upload> finished(bool remove_rest) const;

  std::filesystem::path folder_of(const std::string& id) const { return folder_ / id; }

 private:
  std::filesystem::path folder_;
  std::uint64_t reserve_bytes_;
};

}  // namespace gyre
