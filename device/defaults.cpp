// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "device/verbs.h"

#include <unistd.h>
#include <cstdio>
#include <cstdlib>

namespace gyre {

int report_error(const Error& error) {
  std::fprintf(stderr, "gyre-device: %s\n", error.message().c_str());
  return error.exit_code();
}

std::filesystem::path data_folder() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data == '/') {
    return std::filesystem::path(data) / "gyre";
  }
  const char* home = std::getenv("HOME");
  return std::filesystem::path(home != nullptr ? home : "/var/lib") / ".local" / "share" / "gyre";
}

std::filesystem::path device_key(const std::filesystem::path& keys) {
  return keys / "device.key";
}

std::filesystem::path host_key(const std::filesystem::path& keys) {
  return keys / "host.pub";
}

std::filesystem::path cameras_folder() {
  return data_folder() / "cameras";
}

std::filesystem::path page_token(const std::filesystem::path& spool) {
  return spool / "page.token";
}

std::string default_device_name() {
  char name[256] = {};
  const bool known = ::gethostname(name, sizeof name - 1) == 0;
  return known && is_safe_name(name) ? name : "gyre-device";
}

}  // namespace gyre
