// SPDX-License-Identifier: Apache-2.0
// The little that is kept of a scan beside the spool, so that the next start knows what this one was doing.
#pragma once

#include "common/bundle/bundle.h"
#include "common/result/result.h"
#include "device/session/session_state.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

struct StoredSession {
  SessionState state = SessionState::idle;
  std::optional<Scan> scan;  // that is open, waited for or shown; its passes are those that are closed
  std::string pass;          // that is on, or comes next
};

// Files in <spool>/session/. What a call wrote is on disk when it returns, whole or not at all.
class SessionStore {
 public:
  explicit SessionStore(const std::filesystem::path& spool) : folder_(spool / "session") {}

  // Before anything else: removes what a crash has left half written.
  void tidy() const;

  Result<void> save(const StoredSession& session) const;
  // Nothing after the first start; a damaged entry counts as nothing, too.
  std::optional<StoredSession> load() const;

  // What was decided about the frames of a closed pass, kept until the scan is closed.
  Result<void> save_records(const std::string& scan, const std::string& pass,
                            const std::vector<FrameRecord>& records) const;
  Result<std::vector<FrameRecord>> load_records(const std::string& scan, const std::string& pass) const;
  void forget_records() const;

 private:
  std::filesystem::path file_of(const std::string& scan, const std::string& pass) const;

  std::filesystem::path folder_;
};

}  // namespace gyre
