// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/packet_line.h"

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <deque>
#include <random>
#include <vector>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t largest_packet = 65536;

int open_tun(const std::string& name) {
  const int fd = ::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return -1;
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(fd, TUNSETIFF, &request) == 0) return fd;
  ::close(fd);
  return -1;
}

struct Packet {
  Clock::time_point due;
  std::string bytes;
};

void carry(int from, int to, int stop, PacketLineOptions options) {
  std::mt19937 random(options.seed);
  std::bernoulli_distribution is_lost(options.loss);
  std::deque<Packet> under_way;
  Clock::time_point free{};  // when the last packet has gone
  std::vector<char> block(largest_packet);
  while (true) {
    std::array<pollfd, 2> watched = {{{from, POLLIN, 0}, {stop, POLLIN, 0}}};
    timespec patience{1, 0};
    if (!under_way.empty()) {
      const auto left = std::max(under_way.front().due - Clock::now(), Clock::duration::zero());
      patience = {0, std::chrono::duration_cast<std::chrono::nanoseconds>(left).count()};
    }
    ::ppoll(watched.data(), watched.size(), &patience, nullptr);
    if (watched[1].revents != 0) return;
    for (ssize_t size = 0; (size = ::read(from, block.data(), block.size())) > 0;) {
      if (under_way.size() >= options.limit || is_lost(random)) continue;
      const auto bytes = static_cast<std::size_t>(size);
      const std::chrono::duration<double> sending(8.0 * static_cast<double>(bytes) / options.bits_per_s);
      free = std::max(free, Clock::now()) + std::chrono::duration_cast<Clock::duration>(sending);
      under_way.push_back({free + options.delay, std::string(block.data(), bytes)});
    }
    for (; !under_way.empty() && under_way.front().due <= Clock::now(); under_way.pop_front()) {
      // What the other end does not take is lost, as anywhere.
      const std::string& bytes = under_way.front().bytes;
      [[maybe_unused]] const ssize_t written = ::write(to, bytes.data(), bytes.size());
    }
  }
}

}  // namespace

Result<std::unique_ptr<PacketLine>> PacketLine::make(const std::string& one_end, const std::string& other_end,
                                                     const PacketLineOptions& options) {
  const int one = open_tun(one_end);
  const int other = one < 0 ? -1 : open_tun(other_end);
  const int code = errno;
  const int stop = ::eventfd(0, EFD_CLOEXEC);
  std::unique_ptr<PacketLine> line(new PacketLine({one, other}, stop, options));
  if (other < 0) return fail("cannot make TUN devices", std::strerror(code), "run as root, on a kernel with TUN");
  return line;
}

PacketLine::PacketLine(std::array<int, 2> ends, int stop, const PacketLineOptions& options) : ends_(ends), stop_(stop) {
  if (ends[0] < 0 || ends[1] < 0) return;
  PacketLineOptions back = options;
  ++back.seed;
  ways_[0] = std::thread(carry, ends[0], ends[1], stop, options);
  ways_[1] = std::thread(carry, ends[1], ends[0], stop, back);
}

PacketLine::~PacketLine() {
  ::eventfd_write(stop_, 1);
  for (std::thread& way : ways_) {
    if (way.joinable()) way.join();
  }
  for (const int fd : {ends_[0], ends_[1], stop_}) {
    if (fd >= 0) ::close(fd);
  }
}

}  // namespace gyre
