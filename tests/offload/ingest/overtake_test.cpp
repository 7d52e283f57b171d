// SPDX-License-Identifier: Apache-2.0
// On a slow line, what is small arrives before the bulk that was there before it.
#include "tests/offload/ingest/link_support.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <thread>

namespace gyre {
namespace {

// A line with little room in it and so many bytes a second upwards: everything for one connection of the device.
class SlowLine {
 public:
  SlowLine(std::uint16_t host_port, double bytes_per_s) : host_port_(host_port), rate_(bytes_per_s) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int small = 64 << 10;
    ::setsockopt(listener_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in address = loopback(0);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    socklen_t length = sizeof address;
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { carry(); });
  }
  ~SlowLine() {
    over_ = true;
    thread_.join();
    ::close(listener_);
  }
  std::string endpoint() const { return "tcp://127.0.0.1:" + std::to_string(port_); }

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  static bool forward(int from, int to, std::size_t& bytes) {
    std::array<char, 16 << 10> block{};
    const ssize_t got = ::read(from, block.data(), block.size());
    bytes = got > 0 ? static_cast<std::size_t>(got) : 0;
    for (std::size_t sent = 0; sent < bytes;) {
      const ssize_t n = ::send(to, block.data() + sent, bytes - sent, MSG_NOSIGNAL);
      if (n <= 0) return false;
      sent += static_cast<std::size_t>(n);
    }
    return got > 0;
  }
  void carry() const {
    pollfd wait{listener_, POLLIN, 0};
    while (!over_ && ::poll(&wait, 1, 50) <= 0) {
    }
    if (over_) return;
    const int device = ::accept(listener_, nullptr, nullptr);
    const int host = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(host_port_);
    EXPECT_EQ(::connect(host, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    auto due = std::chrono::steady_clock::now();
    for (bool open = true; open && !over_;) {
      const auto now = std::chrono::steady_clock::now();
      const bool upwards = now >= due;
      std::array<pollfd, 2> ends = {{{device, static_cast<short>(upwards ? POLLIN : 0), 0}, {host, POLLIN, 0}}};
      ::poll(ends.data(), ends.size(), upwards ? 50 : 1);
      std::size_t bytes = 0;
      if (ends[1].revents != 0) open = forward(host, device, bytes);
      if (upwards && ends[0].revents != 0 && open) {
        open = forward(device, host, bytes);
        due = std::max(due, now - std::chrono::milliseconds(10)) +
              std::chrono::nanoseconds(static_cast<long>(1e9 * static_cast<double>(bytes) / rate_));
      }
    }
    ::close(device);
    ::close(host);
  }

  std::uint16_t host_port_;
  double rate_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

TEST(Overtake, ASmallMessageDoesNotWaitForTheBulkBeforeIt) {
  TestHost host;
  host.set_credit(64 << 20);
  TestDevice device("rig");
  host.authorise(device.options().keys);
  host.start();
  const std::string& endpoint = host.options().endpoint;
  const auto port = static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  constexpr double rate = 4e6;
  SlowLine line(port, rate);
  device.open_spool();
  const Scan large = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), large, {0, 1, 2, 3, 4, 5, 6, 7}, 4 << 20, 1));
  device.connect(host, line.endpoint());
  constexpr std::uint64_t some = 4 << 20;
  ASSERT_TRUE(eventually([&] { return bytes_below(host.folder()) > some; }));
  const Scan small = small_scan();
  ASSERT_TRUE(device.spool().open_scan(small));
  const std::uint64_t before = bytes_below(host.folder());
  ASSERT_TRUE(eventually([&] { return host.store().scan(small.id).value().has_value(); }));
  // Half a second of the line, and the chunk it waits for; all 28 MiB could have gone by credit.
  EXPECT_LT(bytes_below(host.folder()) - before, static_cast<std::uint64_t>(rate / 2) + (1 << 20));
}

}  // namespace
}  // namespace gyre
