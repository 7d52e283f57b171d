// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/keys/keys.h"

#include <sys/stat.h>
#include <algorithm>
#include <ctime>

namespace gyre {

namespace {

constexpr std::string_view key_suffix = ".pub";
constexpr std::size_t longest_name = 64;

std::filesystem::path file_of(const std::filesystem::path& allow_list, const std::string& name) {
  return allow_list / (name + std::string(key_suffix));
}

}  // namespace

bool AllowList::contains(const std::string& public_key) {
  // Times of change are only as fine as the kernel's tick: within some ticks of one, there may be another unseen.
  constexpr std::int64_t ticks_ns = 50'000'000;
  const auto ns_of = [](const timespec& t) { return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec; };
  struct stat info {};
  const std::int64_t changed = ::stat(folder_.c_str(), &info) == 0 ? ns_of(info.st_mtim) : 0;
  if (changed == 0 || changed != changed_ns_) {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME_COARSE, &now);
    const std::int64_t age = ns_of(now) - changed;
    changed_ns_ = age > ticks_ns ? changed : 0;
    keys_.clear();
    for (const AuthorisedDevice& device : authorised_devices(folder_)) keys_.insert(device.public_key);
  }
  return keys_.contains(public_key);
}

bool is_device_name(std::string_view name) {
  return name.size() <= longest_name && is_safe_name(name);
}

Result<void> authorise_device(const std::filesystem::path& allow_list, const std::string& name,
                              const std::string& public_key) {
  if (!is_device_name(name)) {
    return wrong_use("not a device name", name, "use letters, digits, '-', '_' and '.', 64 at most");
  }
  std::error_code error;
  std::filesystem::create_directories(allow_list, error);
  if (error) return fail("cannot create the list of devices", allow_list.string());
  return write_public_key(file_of(allow_list, name), public_key);
}

Result<void> revoke_device(const std::filesystem::path& allow_list, const std::string& name) {
  std::error_code error;
  if (!is_device_name(name) || !std::filesystem::remove(file_of(allow_list, name), error) || error) {
    return fail("no such device on the list", name);
  }
  return sync_path(allow_list);
}

std::vector<AuthorisedDevice> authorised_devices(const std::filesystem::path& allow_list) {
  std::vector<AuthorisedDevice> devices;
  std::error_code error;
  for (auto it = std::filesystem::directory_iterator(allow_list, error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error)) {
    const std::filesystem::path& file = it->path();
    if (file.extension() != key_suffix) continue;
    if (Result<std::string> key = read_public_key(file)) devices.push_back({file.stem().string(), std::move(*key)});
  }
  std::sort(devices.begin(), devices.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return devices;
}

std::optional<std::string> authorised_name(const std::filesystem::path& allow_list, std::string_view public_key) {
  for (AuthorisedDevice& device : authorised_devices(allow_list)) {
    if (device.public_key == public_key) return std::move(device.name);
  }
  return std::nullopt;
}

}  // namespace gyre
