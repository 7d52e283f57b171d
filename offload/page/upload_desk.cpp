// SPDX-License-Identifier: Apache-2.0
#include "offload/page/upload_desk.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/disk_space.h"
#include "common/bundle/ulid.h"
#include "common/log/utc_time.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::array<const char*, 3> passes = {"body", "head", "turn"};
constexpr const char* record_name = "upload.json";
constexpr std::chrono::hours forgotten_after{24};

bool is_pass(std::string_view name) {
  return std::find(passes.begin(), passes.end(), name) != passes.end();
}

bool is_kind(std::string_view kind) {
  constexpr std::size_t longest = 4;
  return !kind.empty() && kind.size() <= longest &&
         std::all_of(kind.begin(), kind.end(), [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); });
}

// Files of an upload are <pass>.<kind>.
std::optional<fs::path> recording_of(const fs::path& folder, std::string_view pass) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const fs::path& file = entry.path();
    if (file.stem() == pass && is_kind(file.extension().string().substr(1))) return file;
  }
  return std::nullopt;
}

Result<void> write_whole(const fs::path& file, const UploadDesk::Reader& read) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return fail("cannot keep the recording", file.string() + " (" + std::strerror(errno) + ")");
  int failure = 0;
  const bool whole = read([&](std::string_view piece) {
    while (!piece.empty()) {
      const ssize_t wrote = ::write(fd, piece.data(), piece.size());
      if (wrote < 0 && errno == EINTR) continue;
      if (wrote < 0) {
        failure = errno;
        return false;
      }
      piece.remove_prefix(static_cast<std::size_t>(wrote));
    }
    return true;
  });
  if (whole && ::fsync(fd) != 0) failure = errno;
  ::close(fd);
  if (failure != 0) return fail("cannot keep the recording", std::strerror(failure), "free some space on the host");
  if (!whole) return fail("the recording did not come whole", "", "send it again; it may be too large");
  return {};
}

std::optional<Upload> read_upload(const fs::path& folder) {
  const Result<std::string> text = read_file(folder / record_name);
  if (!text) return std::nullopt;
  const json record = json::parse(*text, nullptr, false);
  if (!record.is_object()) return std::nullopt;
  Upload upload;
  upload.id = folder.filename().string();
  upload.created = record.value("created", "");
  if (const auto height = record.find("height_mm"); height != record.end() && height->is_number()) {
    upload.height_mm = height->get<double>();
  }
  for (const char* pass : passes) {
    if (const auto file = recording_of(folder, pass)) upload.recordings.push_back({pass, *file});
  }
  if (upload.recordings.empty()) return std::nullopt;
  return upload;
}

}  // namespace

Result<std::string> UploadDesk::begin(std::uint64_t bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return fail("cannot create the folder for uploads", folder_.string() + " (" + error.message() + ")");
  const auto now = fs::file_time_type::clock::now();
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const auto changed = fs::last_write_time(entry.path(), error);
    if (!error && !fs::exists(entry.path() / record_name, error) && now - changed > forgotten_after) {
      fs::remove_all(entry.path(), error);
    }
  }
  const Result<std::uint64_t> left = free_bytes(folder_);
  if (!left) return tl::unexpected(left.error());
  if (bytes > *left || *left - bytes < reserve_bytes_) {
    return fail("there is no room for the recording on the host", "", "free some space there, or delete scans");
  }
  const std::string id = new_ulid();
  fs::create_directory(folder_of(id), error);
  if (error) return fail("cannot create the folder of the upload", folder_of(id).string());
  return id;
}

Result<void> UploadDesk::take(const std::string& id, const std::string& pass, const std::string& kind,
                              const Reader& read) {
  std::error_code error;
  const fs::path folder = folder_of(id);
  if (!is_ulid(id) || !fs::is_directory(folder, error)) return wrong_use("there is no such upload", id, "begin again");
  if (fs::exists(folder / record_name, error)) return wrong_use("the upload is finished already", id);
  if (!is_pass(pass)) return wrong_use("there is no such pass", pass, "send body, head or turn");
  if (!is_kind(kind)) return wrong_use("the file's kind is not letters and digits", kind);
  // Not <pass>.part: that would be taken for a recording of that kind.
  const fs::path part = folder / ("." + pass);
  if (const Result<void> written = write_whole(part, read); !written) {
    fs::remove(part, error);
    return written;
  }
  if (const auto before = recording_of(folder, pass)) fs::remove(*before, error);
  return rename_durably(part, folder / (pass + "." + kind));
}

Result<void> UploadDesk::finish(const std::string& id, std::optional<double> height_mm) {
  std::error_code error;
  const fs::path folder = folder_of(id);
  if (!is_ulid(id) || !fs::is_directory(folder, error)) return wrong_use("there is no such upload", id, "begin again");
  if (!recording_of(folder, "body") && !recording_of(folder, "turn")) {
    return wrong_use("there is no recording of the whole body", id, "send one first");
  }
  const json record = {{"created", utc_now()}, {"height_mm", height_mm ? json(*height_mm) : json()}};
  return write_file(folder / record_name, record.dump() + "\n");
}

void UploadDesk::remove(const std::string& id) const {
  std::error_code error;
  if (is_ulid(id)) fs::remove_all(folder_of(id), error);
}

std::vector<Upload> UploadDesk::finished(bool remove_rest) const {
  std::vector<Upload> uploads;
  std::error_code error;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder_, error)) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  for (const fs::path& folder : folders) {
    if (!is_ulid(folder.filename().string())) continue;
    if (std::optional<Upload> upload = read_upload(folder)) {
      uploads.push_back(std::move(*upload));
    } else if (remove_rest) {
      fs::remove_all(folder, error);
    }
  }
  return uploads;
}

}  // namespace gyre
