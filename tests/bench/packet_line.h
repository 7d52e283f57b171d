// SPDX-License-Identifier: Apache-2.0
// A line for IP packets with rate, delay and loss, in user space between two TUN devices: what `tc netem` does, for a
// kernel that has none. Real TCP runs over it and loses real packets.
#pragma once

#include "common/result/result.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <thread>

namespace gyre {

// Each way by itself. A packet waits until those before it have gone at the rate, then takes the delay.
struct PacketLineOptions {
  double bits_per_s = 20e6;
  std::chrono::milliseconds delay{25};
  double loss = 0.01;        // chance of a packet to be lost
  std::size_t limit = 1000;  // packets under way; what comes then is lost
  unsigned seed = 1;
};

// Carries until it is destroyed; the devices go with it.
class PacketLine {
 public:
  // Makes the devices, which are then to be given addresses, or other network namespaces. Error: no rights, or no TUN.
  static Result<std::unique_ptr<PacketLine>> make(const std::string& one_end, const std::string& other_end,
                                                  const PacketLineOptions& options);
  PacketLine(const PacketLine&) = delete;
  PacketLine& operator=(const PacketLine&) = delete;
  ~PacketLine();

 private:
  PacketLine(std::array<int, 2> ends, int stop, const PacketLineOptions& options);

  std::array<int, 2> ends_;
  int stop_;
  std::array<std::thread, 2> ways_;
};

}  // namespace gyre
