// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/ingest/tcp_proxy.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <chrono>

namespace gyre {

namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

}  // namespace

TcpProxy::TcpProxy(int port) : target_(port) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = loopback(0);
  ::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address);
  ::listen(listener_, SOMAXCONN);
  socklen_t length = sizeof address;
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { carry(); });
}

TcpProxy::~TcpProxy() {
  over_ = true;
  thread_.join();
  ::close(listener_);
}

void TcpProxy::accept_one() {
  const Line line{::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC),
                  ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  const sockaddr_in address = loopback(target_);
  if (::connect(line.far, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    lines_.push_back(line);
    return;
  }
  ::close(line.near);
  ::close(line.far);
}

bool TcpProxy::forward(int from, int to, bool upwards) {
  std::array<char, 16 << 10> block{};
  std::size_t most = block.size();
  const std::uint64_t cut_at = cut_at_;
  if (cut_at > carried_) most = std::min<std::size_t>(most, cut_at - carried_);
  const ssize_t got = ::read(from, block.data(), most);
  if (got <= 0) return false;
  for (ssize_t sent = 0; sent < got;) {
    const ssize_t n = ::send(to, block.data() + sent, static_cast<std::size_t>(got - sent), MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += n;
  }
  carried_ += static_cast<std::uint64_t>(got);
  if (recording_ && upwards) {
    const std::lock_guard lock(mutex_);
    recorded_.append(block.data(), static_cast<std::size_t>(got));
  }
  return true;
}

void TcpProxy::carry() {
  using Clock = std::chrono::steady_clock;
  Clock::time_point due = Clock::now();
  while (!over_) {
    constexpr int look_again_ms = 10;
    std::vector<pollfd> ends = {{listener_, POLLIN, 0}};
    const bool may_carry = limit_ == 0 || Clock::now() >= due;
    for (const Line& line : lines_) {
      const auto wanted = static_cast<short>(may_carry ? POLLIN : 0);
      ends.push_back({line.near, wanted, 0});
      ends.push_back({line.far, wanted, 0});
    }
    ::poll(ends.data(), ends.size(), look_again_ms);
    const std::uint64_t before = carried_;
    std::vector<Line> kept;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const Line line = lines_[i];
      bool open = true;
      if (ends[2 * i + 1].revents != 0) open = forward(line.near, line.far, true);
      if (open && ends[2 * i + 2].revents != 0) open = forward(line.far, line.near, false);
      if (open) {
        kept.push_back(line);
        continue;
      }
      ::close(line.near);
      ::close(line.far);
    }
    lines_ = std::move(kept);
    if (cut_at_ != 0 && carried_ >= cut_at_) {
      for (const Line& line : lines_) {
        ::close(line.near);
        ::close(line.far);
      }
      lines_.clear();
      cut_at_ = 0;
    }
    if (ends[0].revents != 0) accept_one();
    if (const std::uint64_t limit = limit_; limit > 0 && carried_ > before) {
      due = Clock::now() + std::chrono::microseconds((carried_ - before) * 1'000'000 / limit);
    }
  }
  for (const Line& line : lines_) {
    ::close(line.near);
    ::close(line.far);
  }
}

}  // namespace gyre
