// SPDX-License-Identifier: Apache-2.0
// Fetches the results of a scan from the host, chunk by chunk, into the spool.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "device/spool/spool.h"

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace gyre {

// One offer of the host. What was fetched of a file stays on disk, so the next connection goes on from there.
class Download {
 public:
  using Send = std::function<Result<void>(wire::Message message)>;

  Download(Spool& spool, wire::ResultOffer offer) : spool_(spool), offer_(std::move(offer)) {}

  // Asks for what is missing; ends at once when nothing is. Errors: the disk, or the connection.
  Result<void> start(const Send& send);
  Result<void> on(const wire::ResultChunk& chunk, const Send& send);

  const std::string& scan() const { return offer_.scan; }
  bool finished() const { return next_file_ == offer_.files.size(); }

 private:
  const wire::FileEntry& file() const { return offer_.files[next_file_]; }
  std::filesystem::path part() const;
  Result<void> advance(const Send& send);
  Result<void> ask(const Send& send);

  Spool& spool_;
  wire::ResultOffer offer_;
  std::size_t next_file_ = 0;          // the one being fetched
  std::uint64_t received_ = 0;         // bytes of it on disk
  std::uint64_t asked_ = 0;            // bytes of it asked for
  std::optional<std::uint64_t> hole_;  // where a chunk was last found to be missing
  int damaged_ = 0;                    // times a whole file did not match its hash
};

}  // namespace gyre
