// SPDX-License-Identifier: Apache-2.0
// Bytes out of an SPI port.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace gyre {

// Belongs to one thread.
class SpiPort {
 public:
  // device: "/dev/spidev0.0". Errors: no such device, none that can do that rate, no permission.
  static Result<std::unique_ptr<SpiPort>> open(const std::string& device, int hertz);
  ~SpiPort();
  SpiPort(const SpiPort&) = delete;
  SpiPort& operator=(const SpiPort&) = delete;

  // At most 4096 bytes, without a pause between them.
  Result<void> send(std::span<const std::uint8_t> bytes);

 private:
  SpiPort(int fd, std::string device) : fd_(fd), device_(std::move(device)) {}

  int fd_;
  std::string device_;
};

}  // namespace gyre
