// SPDX-License-Identifier: Apache-2.0
#include "offload/store/receipts.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;

std::uint64_t bytes_of(const DeletionReceipt& receipt) {
  std::uint64_t bytes = 0;
  for (const StoredFile& file : receipt.files) bytes += file.size;
  return bytes;
}

}  // namespace

json to_json(const DeletionReceipt& receipt) {
  json files = json::array();
  for (const StoredFile& file : receipt.files) {
    files.push_back({{"name", file.name}, {"size", file.size}, {"sha256", file.sha256}});
  }
  return {{"deleted", receipt.scan},
          {"at", receipt.at},
          {"device", receipt.device_name},
          {"bytes", bytes_of(receipt)},
          {"files", std::move(files)}};
}

Result<void> keep_receipt(const std::filesystem::path& store, const DeletionReceipt& receipt, std::string_view why) {
  spdlog::info("scan {}: deleted, {}: {} files of device {}, {} bytes", receipt.scan, why, receipt.files.size(),
               receipt.device_name, bytes_of(receipt));
  json line = to_json(receipt);
  line["why"] = why;
  const std::string text = line.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
  const std::filesystem::path file = store / "receipts.jsonl";
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  const bool good =
      fd >= 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(fd) == 0;
  const int code = errno;
  if (fd >= 0) ::close(fd);
  if (good) return {};
  return fail("cannot keep the receipt of a deletion", file.string() + " (" + std::strerror(code) + ")",
              "the scan is gone; the log has what it was");
}

}  // namespace gyre
