// SPDX-License-Identifier: Apache-2.0
// Talks to the service manager that started this program, by systemd's notification protocol: one datagram a message to
// the socket named in $NOTIFY_SOCKET. https://www.freedesktop.org/software/systemd/man/sd_notify.html
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace gyre {

class ServiceManager {
 public:
  // Nobody to tell: every call does nothing and succeeds.
  ServiceManager() = default;

  // The manager that the environment names, or nobody when it names none. Takes the variables out of the environment,
  // so that no child speaks in this program's name; call it before there are threads. Errors (wrong use): the socket is
  // neither a path nor an abstract name, or too long for one.
  static Result<ServiceManager> from_environment();

  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager& operator=(ServiceManager&& other) noexcept;
  ~ServiceManager();

  bool is_there() const { return socket_ >= 0; }

  // A sign of life is due at least this often, when the manager wants any.
  std::optional<std::chrono::microseconds> watchdog() const { return watchdog_; }

  // All may be called from any thread and never wait: a manager that does not read loses the message. Errors: it was
  // not sent.
  Result<void> ready() const { return send("READY=1"); }
  Result<void> stopping() const { return send("STOPPING=1"); }
  Result<void> alive() const { return send("WATCHDOG=1"); }
  // What the program is doing, for people: one line; what follows a line break is left out.
  Result<void> status(std::string_view text) const;

 private:
  Result<void> send(const std::string& message) const;

  int socket_ = -1;  // connected to the manager's
  std::optional<std::chrono::microseconds> watchdog_;
};

}  // namespace gyre
