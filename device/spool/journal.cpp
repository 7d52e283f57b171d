// SPDX-License-Identifier: Apache-2.0
#include "device/spool/journal.h"

#include "common/bundle/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace gyre {

namespace {

using nlohmann::json;

tl::unexpected<Error> system_error(const std::string& what, const std::filesystem::path& path) {
  const int code = errno;
  return fail(what, path.string() + " (" + std::strerror(code) + ")",
              code == ENOSPC || code == EDQUOT ? "free some disk space and try again" : "");
}

std::string line_of(const SpoolEvent& event) {
  json j = {{"event", name_of(event.kind)}};
  if (!event.name.empty()) j["name"] = event.name;
  if (!event.sha256.empty()) {
    j["size"] = event.size;
    j["sha256"] = event.sha256;
  }
  if (!event.reason.empty()) j["reason"] = event.reason;
  return j.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::optional<SpoolEvent> event_of(std::string_view line) {
  const json j = json::parse(line, nullptr, false);
  if (!j.is_object()) return std::nullopt;
  try {
    SpoolEvent event;
    const std::string kind = j.at("event").get<std::string>();
    for (int k = 0; k <= static_cast<int>(SpoolEvent::Kind::delivered); ++k) {
      event.kind = static_cast<SpoolEvent::Kind>(k);
      if (name_of(event.kind) != kind) continue;
      event.name = j.value("name", "");
      event.size = j.value("size", std::uint64_t{0});
      event.sha256 = j.value("sha256", "");
      event.reason = j.value("reason", "");
      return event;
    }
  } catch (const json::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

Result<SpoolJournal> SpoolJournal::open(const std::filesystem::path& file, std::vector<SpoolEvent>& events) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0) return system_error("cannot open the journal of a scan", file);
  SpoolJournal journal(fd, file);
  const Result<std::string> content = read_file(file);
  if (!content) return tl::unexpected(content.error());

  std::size_t good = 0;  // bytes of whole lines that parse
  while (good < content->size()) {
    const std::size_t end = content->find('\n', good);
    const bool last = end == std::string::npos || end + 1 == content->size();
    std::optional<SpoolEvent> event;
    if (end != std::string::npos) event = event_of(std::string_view(*content).substr(good, end - good));
    if (!event && !last) {
      return fail("the journal of a scan is damaged", file.string(),
                  "its keyframes are still in the folder next to it");
    }
    if (!event) break;
    events.push_back(std::move(*event));
    good = end + 1;
  }
  if (good < content->size() && (::ftruncate(fd, static_cast<off_t>(good)) != 0 || ::fsync(fd) != 0)) {
    return system_error("cannot repair the journal of a scan", file);
  }
  journal.size_ = static_cast<std::int64_t>(good);
  if (Result<void> synced = sync_path(file.parent_path()); !synced) return tl::unexpected(synced.error());
  return journal;
}

SpoolJournal::SpoolJournal(SpoolJournal&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), file_(std::move(other.file_)), size_(other.size_) {}

SpoolJournal& SpoolJournal::operator=(SpoolJournal&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(file_, other.file_);
  std::swap(size_, other.size_);
  return *this;
}

SpoolJournal::~SpoolJournal() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> SpoolJournal::append(const SpoolEvent& event) {
  const std::string line = line_of(event);
  const auto cannot_write = [&] { return system_error("cannot write the journal of a scan", file_); };
  struct stat now {};
  if (::fstat(fd_, &now) != 0) return cannot_write();
  if (now.st_size != size_ && ::ftruncate(fd_, size_) != 0) return cannot_write();
  const ssize_t written = ::write(fd_, line.data(), line.size());
  if (written >= 0 && written < static_cast<ssize_t>(line.size())) errno = ENOSPC;
  const bool repeated = event.kind == SpoolEvent::Kind::stored;
  if (written == static_cast<ssize_t>(line.size()) && (repeated || ::fdatasync(fd_) == 0)) {
    size_ += written;
    return {};
  }
  return cannot_write();
}

}  // namespace gyre
