// SPDX-License-Identifier: Apache-2.0
#include "common/service/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace gyre {

namespace {

std::string take_variable(const char* name) {
  const char* value = std::getenv(name);
  std::string text = value != nullptr ? value : "";
  ::unsetenv(name);
  return text;
}

template <class T>
std::optional<T> number_of(const std::string& text) {
  T number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

struct SocketAddress {
  sockaddr_un address{};
  socklen_t length = 0;
};

// "/path", or "@name" for an abstract one, which begins with a zero instead and is not terminated.
Result<SocketAddress> address_of(const std::string& name) {
  SocketAddress to;
  to.address.sun_family = AF_UNIX;
  if (name.size() < 2 || (name[0] != '/' && name[0] != '@')) {
    return wrong_use("NOTIFY_SOCKET names no socket of this machine", name, "unset it, or let systemd set it");
  }
  if (name.size() >= sizeof(to.address.sun_path)) return wrong_use("NOTIFY_SOCKET is too long for a socket", name);
  std::memcpy(to.address.sun_path, name.data(), name.size());
  if (name[0] == '@') to.address.sun_path[0] = '\0';
  const std::size_t end = name[0] == '@' ? name.size() : name.size() + 1;
  to.length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + end);
  return to;
}

}  // namespace

Result<ServiceManager> ServiceManager::from_environment() {
  const std::string name = take_variable("NOTIFY_SOCKET");
  const std::string interval = take_variable("WATCHDOG_USEC");
  const std::string watched = take_variable("WATCHDOG_PID");
  ServiceManager manager;
  if (name.empty()) return manager;
  const Result<SocketAddress> to = address_of(name);
  if (!to) return tl::unexpected(to.error());
  manager.socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (manager.socket_ < 0 ||
      ::connect(manager.socket_, reinterpret_cast<const sockaddr*>(&to->address), to->length) != 0) {
    return fail("cannot reach the service manager", name + " (" + std::strerror(errno) + ")");
  }
  const std::optional<long long> microseconds = number_of<long long>(interval);
  const bool is_watched = watched.empty() || number_of<pid_t>(watched) == ::getpid();
  if (microseconds && *microseconds > 0 && is_watched) manager.watchdog_ = std::chrono::microseconds(*microseconds);
  return manager;
}

ServiceManager::ServiceManager(ServiceManager&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), watchdog_(std::exchange(other.watchdog_, std::nullopt)) {}

ServiceManager& ServiceManager::operator=(ServiceManager&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(watchdog_, other.watchdog_);
  return *this;
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) ::close(socket_);
}

Result<void> ServiceManager::status(std::string_view text) const {
  // A second line would be a message of its own.
  return send("STATUS=" + std::string(text.substr(0, text.find('\n'))));
}

Result<void> ServiceManager::send(const std::string& message) const {
  if (socket_ < 0) return {};
  ssize_t sent = 0;
  do {
    sent = ::send(socket_, message.data(), message.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  if (sent < 0) return fail("the service manager was not told", message + " (" + std::strerror(errno) + ")");
  return {};
}

}  // namespace gyre
