// SPDX-License-Identifier: Apache-2.0
#include "device/panel/spi.h"

#include <fcntl.h>
#include <linux/spi/spidev.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>

namespace gyre {

Result<std::unique_ptr<SpiPort>> SpiPort::open(const std::string& device, int hertz) {
  const int fd = ::open(device.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) {
    return fail("cannot open the SPI port", device + " (" + std::strerror(errno) + ")",
                "switch SPI on in the board's set-up, and let this user be in the group spi");
  }
  std::unique_ptr<SpiPort> port(new SpiPort(fd, device));
  const std::uint8_t mode = SPI_MODE_0;
  const std::uint8_t bits = 8;
  const auto speed = static_cast<std::uint32_t>(hertz);
  if (::ioctl(fd, SPI_IOC_WR_MODE, &mode) != 0 || ::ioctl(fd, SPI_IOC_WR_BITS_PER_WORD, &bits) != 0 ||
      ::ioctl(fd, SPI_IOC_WR_MAX_SPEED_HZ, &speed) != 0) {
    return fail("cannot set up the SPI port", device + " (" + std::strerror(errno) + ")");
  }
  return port;
}

SpiPort::~SpiPort() {
  ::close(fd_);
}

Result<void> SpiPort::send(std::span<const std::uint8_t> bytes) {
  if (::write(fd_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size())) return {};
  return fail("cannot send to the SPI port", device_ + " (" + std::strerror(errno) + ")");
}

}  // namespace gyre
