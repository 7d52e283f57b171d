// SPDX-License-Identifier: Apache-2.0
#include "common/http/own_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <array>

namespace gyre {

namespace {

// A connected datagram socket has the address its packets would leave by; 192.0.2.1 is nobody's (RFC 5737).
std::string address_towards_others() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return {};
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(9);
  ::inet_pton(AF_INET, "192.0.2.1", &address.sin_addr);
  socklen_t length = sizeof(address);
  std::array<char, INET_ADDRSTRLEN> text{};
  const bool known = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), length) == 0 &&
                     ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
                     ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size()) != nullptr;
  ::close(fd);
  return known ? text.data() : "";
}

}  // namespace

std::string own_address() {
  if (std::string address = address_towards_others(); !address.empty()) return address;
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

}  // namespace gyre
