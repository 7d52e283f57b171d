// SPDX-License-Identifier: Apache-2.0
#include "common/http/listen_address.h"

#include "common/http/access.h"

namespace gyre {

bool ListenAddress::is_open() const {
  return !is_loopback_address(address) && address != "localhost";
}

bool ListenAddress::is_every() const {
  return address == "0.0.0.0" || address == "::";
}

Result<ListenAddress> parse_listen_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool is_number = !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number || colon == 0 || std::stoi(port) > 65535) {
    return wrong_use("not ADDRESS:PORT", text, "give 127.0.0.1:7480, say");
  }
  ListenAddress parsed{text.substr(0, colon), std::stoi(port)};
  if (parsed.address.starts_with('[') && parsed.address.ends_with(']')) {
    parsed.address = parsed.address.substr(1, parsed.address.size() - 2);
  }
  return parsed;
}

}  // namespace gyre
