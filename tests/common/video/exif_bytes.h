// SPDX-License-Identifier: Apache-2.0
// EXIF blocks and pictures that carry them, byte by byte.
#pragma once

#include <cstdint>
#include <string>

namespace gyre::test {

inline std::string number(std::uint32_t value, int size, bool little_endian) {
  std::string out;
  for (int i = 0; i < size; ++i) {
    const int shift = 8 * (little_endian ? i : size - 1 - i);
    out.push_back(static_cast<char>(value >> shift & 0xffU));
  }
  return out;
}

// A TIFF structure whose IFD0 holds ImageWidth and Orientation.
inline std::string tiff_with_orientation(int orientation, bool little_endian) {
  const auto u16 = [&](std::uint32_t v) { return number(v, 2, little_endian); };
  const auto u32 = [&](std::uint32_t v) { return number(v, 4, little_endian); };
  std::string tiff = (little_endian ? "II" : "MM") + u16(42) + u32(8);
  tiff += u16(2);
  tiff += u16(0x0100) + u16(4) + u32(1) + u32(640);
  tiff += u16(0x0112) + u16(3) + u32(1) + u16(static_cast<std::uint32_t>(orientation)) + u16(0);
  return tiff + u32(0);
}

// A TIFF structure with an Exif directory that holds FocalLengthIn35mmFilm, millimetres.
inline std::string tiff_with_focal(int focal_35mm, bool little_endian) {
  const auto u16 = [&](std::uint32_t v) { return number(v, 2, little_endian); };
  const auto u32 = [&](std::uint32_t v) { return number(v, 4, little_endian); };
  std::string tiff = (little_endian ? "II" : "MM") + u16(42) + u32(8);
  const std::uint32_t behind = 8 + 2 + 12 + 4;
  tiff += u16(1) + u16(0x8769) + u16(4) + u32(1) + u32(behind) + u32(0);
  tiff += u16(1) + u16(0xa405) + u16(3) + u32(1) + u16(static_cast<std::uint32_t>(focal_35mm)) + u16(0);
  return tiff + u32(0);
}

// Puts an EXIF block behind the start of a JPEG file.
inline std::string jpeg_with_exif(const std::string& jpeg, const std::string& tiff) {
  const std::string payload = std::string("Exif\0\0", 6) + tiff;
  return jpeg.substr(0, 2) + "\xff\xe1" + number(static_cast<std::uint32_t>(payload.size() + 2), 2, false) + payload +
         jpeg.substr(2);
}

// Puts an eXIf chunk behind the header of a PNG file; the checksum is left at zero.
inline std::string png_with_exif(const std::string& png, const std::string& tiff) {
  constexpr std::size_t header = 8 + 25;  // signature, IHDR
  return png.substr(0, header) + number(static_cast<std::uint32_t>(tiff.size()), 4, false) + "eXIf" + tiff +
         std::string(4, '\0') + png.substr(header);
}

}  // namespace gyre::test
