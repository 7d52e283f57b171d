// SPDX-License-Identifier: Apache-2.0
#include "device/camera/jpeg_extent.h"

#include <cstddef>
#include <cstdint>

namespace gyre {

namespace {

constexpr std::uint8_t mark = 0xff;
constexpr std::uint8_t start_of_image = 0xd8, end_of_image = 0xd9;

std::uint8_t byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint8_t>(bytes[at]);
}

// In the compressed data of a scan 0xff is followed by nothing but these.
bool belongs_to_scan(std::uint8_t code) {
  constexpr std::uint8_t stuffing = 0x00, first_restart = 0xd0, last_restart = 0xd7;
  return code == stuffing || (code >= first_restart && code <= last_restart);
}

// Markers that no length follows.
bool is_bare(std::uint8_t code) {
  constexpr std::uint8_t temporary = 0x01;
  return belongs_to_scan(code) || code == start_of_image || code == temporary;
}

}  // namespace

std::string_view jpeg_extent(std::string_view bytes) {
  if (bytes.size() < 2 || byte_at(bytes, 0) != mark || byte_at(bytes, 1) != start_of_image) return {};
  // Between segments some cameras write bytes that do no harm; within a scan this passes over its data.
  for (std::size_t at = 2; (at = bytes.find(static_cast<char>(mark), at)) != std::string_view::npos;) {
    if (at + 1 >= bytes.size()) return {};
    const std::uint8_t code = byte_at(bytes, at + 1);
    if (code == mark) {
      ++at;
      continue;
    }
    at += 2;
    if (code == end_of_image) return bytes.substr(0, at);
    if (is_bare(code)) continue;
    if (at + 1 >= bytes.size()) return {};
    const std::size_t length = static_cast<std::size_t>(byte_at(bytes, at)) << 8 | byte_at(bytes, at + 1);
    at += length;
  }
  return {};
}

}  // namespace gyre
