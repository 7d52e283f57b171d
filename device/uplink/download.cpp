// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/download.h"

#include "common/bundle/sha256.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// Chunks under way: 2 MiB fill a 100 Mbit/s line at 150 ms.
constexpr std::uint64_t window = 8 * wire::max_chunk_bytes;
constexpr int max_damaged = 3;

Result<void> append(const fs::path& file, std::string_view data) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const ssize_t written = fd < 0 ? -1 : ::write(fd, data.data(), data.size());
  const int code = written < 0 ? errno : ENOSPC;
  if (fd >= 0) ::close(fd);
  if (written == static_cast<ssize_t>(data.size())) return {};
  return fail("cannot store a result", file.string() + " (" + std::strerror(code) + ")",
              code == ENOSPC || code == EDQUOT ? "free some disk space; it is fetched again then" : "");
}

}  // namespace

fs::path Download::part() const {
  return spool_.bundle(offer_.scan).root() / (file().name + "." + file().sha256 + ".part");
}

Result<void> Download::start(const Send& send) {
  return advance(send);
}

// Goes to the next file that is not here whole, and fetches it; after the last, the scan is delivered.
Result<void> Download::advance(const Send& send) {
  const std::optional<SpooledScan> scan = spool_.scan(offer_.scan);
  if (!scan) return fail("no such scan in the spool", offer_.scan);
  for (; !finished(); ++next_file_) {
    const SpooledFile* known = find_file(scan->results, file().name);
    if (known && known->sha256 == file().sha256) continue;
    std::error_code error;
    const std::uintmax_t held = fs::file_size(part(), error);
    received_ = error ? 0 : std::min<std::uint64_t>(held, file().size);
    asked_ = received_;
    hole_.reset();
    return ask(send);
  }
  if (scan->phase != SpoolPhase::delivered) {
    if (Result<void> done = spool_.deliver_scan(offer_.scan); !done) return done;
  }
  return send(wire::ResultAck{offer_.scan});
}

// Keeps a window of chunks asked for. A file already here in full (empty, or cut off before its hash was checked) needs
// one request too: its answer, without data, leads to the check.
Result<void> Download::ask(const Send& send) {
  const bool check_only = received_ == file().size && asked_ == received_;
  while (check_only || (asked_ < file().size && asked_ < received_ + window)) {
    if (Result<void> sent = send(wire::ResultRequest{offer_.scan, file().name, file().sha256, asked_}); !sent)
      return sent;
    asked_ += wire::max_chunk_bytes;
    if (check_only) break;
  }
  return {};
}

Result<void> Download::on(const wire::ResultChunk& chunk, const Send& send) {
  const bool ours = !finished() && chunk.name == file().name && chunk.sha256 == file().sha256;
  if (!ours || chunk.offset < received_) return {};
  if (chunk.offset > received_) {
    // It overtook one before it, and is not kept. Once for every hole: what was asked for before comes as well.
    if (std::exchange(hole_, received_) == received_) return {};
    asked_ = received_;
    return ask(send);
  }
  if (chunk.data.size() > file().size - received_) return {};
  if (chunk.data.size() != std::min<std::uint64_t>(wire::max_chunk_bytes, file().size - received_)) {
    return fail("the host has less of a result than it says", file().name, "look at the host's disk");
  }
  if (Result<void> stored = append(part(), chunk.data); !stored) return stored;
  received_ += chunk.data.size();
  if (received_ < file().size) return ask(send);
  const Result<std::string> hash = sha256_of_file(part());
  if (!hash) return tl::unexpected(hash.error());
  if (*hash == file().sha256) {
    const SpooledFile result{file().name, file().size, file().sha256, SpooledFilePhase::acknowledged};
    if (Result<void> added = spool_.add_result(offer_.scan, result, part()); !added) return added;
  } else {
    std::error_code error;
    fs::remove(part(), error);
    if (++damaged_ >= max_damaged)
      return fail("a result keeps arriving damaged", file().name, "look at the host's disk");
  }
  return advance(send);
}

}  // namespace gyre
