// SPDX-License-Identifier: Apache-2.0
// The journal of a scan: one line of JSON per event, only ever appended to.
#pragma once

#include "common/result/result.h"
#include "device/spool/spooled_scan.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace gyre {

class SpoolJournal {
 public:
  // Opens or creates a journal and appends what it holds to `events`. A last line that a crash cut short is removed:
  // its event was never reported. Any other damage is an error.
  static Result<SpoolJournal> open(const std::filesystem::path& file, std::vector<SpoolEvent>& events);
  SpoolJournal(SpoolJournal&& other) noexcept;
  SpoolJournal& operator=(SpoolJournal&& other) noexcept;
  ~SpoolJournal();

  // Appends an event and syncs it, but for what the host repeats should it be lost: that a file is stored there. After
  // an error, as on a full disk, the journal is as it was.
  Result<void> append(const SpoolEvent& event);

 private:
  SpoolJournal(int fd, std::filesystem::path file) : fd_(fd), file_(std::move(file)) {}

  int fd_;
  std::filesystem::path file_;
  std::int64_t size_ = 0;  // of the events in it; anything after that is what a failed append left
};

}  // namespace gyre
