// SPDX-License-Identifier: Apache-2.0
#include "common/video/exif.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

namespace gyre {

namespace {

using Bytes = std::span<const std::byte>;

// Reads numbers of either byte order; nothing when they do not lie wholly inside the bytes.
class Reader {
 public:
  Reader(Bytes bytes, bool little_endian) : bytes_(bytes), little_endian_(little_endian) {}

  std::optional<std::uint32_t> number(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || bytes_.size() - offset < size) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t at = little_endian_ ? offset + size - 1 - i : offset + i;
      value = value << 8 | std::to_integer<std::uint32_t>(bytes_[at]);
    }
    return value;
  }
  std::optional<std::uint32_t> u16(std::size_t offset) const { return number(offset, 2); }
  std::optional<std::uint32_t> u32(std::size_t offset) const { return number(offset, 4); }

 private:
  Bytes bytes_;
  bool little_endian_;
};

bool starts_with(Bytes bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

// Value of a tag of type SHORT in the directory at an offset; LONG too, for the offsets of other directories.
std::optional<std::uint32_t> value_of(const Reader& reader, std::optional<std::uint32_t> directory,
                                      std::uint32_t wanted) {
  constexpr std::uint32_t type_short = 3;
  constexpr std::uint32_t type_long = 4;
  const auto count = directory ? reader.u16(*directory) : std::nullopt;
  if (!count) return std::nullopt;
  for (std::size_t i = 0; i < *count; ++i) {
    const std::size_t entry = std::size_t{*directory} + 2 + 12 * i;
    const auto tag = reader.u16(entry);
    if (!tag) break;
    if (*tag != wanted) continue;
    const auto type = reader.u16(entry + 2);
    if (type == type_short) return reader.u16(entry + 8);
    if (type == type_long) return reader.u32(entry + 8);
    break;
  }
  return std::nullopt;
}

// The TIFF structure inside an EXIF block: header, then directories with entries of 12 bytes.
ExifFacts tiff_facts(Bytes tiff) {
  constexpr std::uint32_t orientation_tag = 0x0112;
  constexpr std::uint32_t exif_directory_tag = 0x8769;
  constexpr std::uint32_t focal_35mm_tag = 0xa405;
  ExifFacts facts;
  const bool little_endian = starts_with(tiff, "II");
  if (!little_endian && !starts_with(tiff, "MM")) return facts;
  const Reader reader(tiff, little_endian);
  if (reader.u16(2) != 42U) return facts;
  const auto first = reader.u32(4);
  const auto orientation = value_of(reader, first, orientation_tag);
  if (orientation && *orientation >= 1 && *orientation <= 8) facts.orientation = static_cast<Orientation>(*orientation);
  const auto focal = value_of(reader, value_of(reader, first, exif_directory_tag), focal_35mm_tag);
  if (focal && *focal > 0) facts.focal_35mm = *focal;
  return facts;
}

ExifFacts jpeg_facts(Bytes file) {
  constexpr std::uint32_t app1 = 0xe1;
  constexpr std::uint32_t start_of_scan = 0xda;
  constexpr std::uint32_t end_of_image = 0xd9;
  constexpr std::string_view exif_header("Exif\0\0", 6);
  const Reader reader(file, false);
  std::size_t at = 2;
  while (reader.number(at, 1) == 0xffU) {
    const auto marker = reader.number(at + 1, 1);
    if (!marker || *marker == start_of_scan || *marker == end_of_image) break;
    if (*marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    const auto length = reader.u16(at + 2);  // counts its own two bytes
    if (!length || *length < 2 || file.size() - at - 2 < *length) break;
    const Bytes payload = file.subspan(at + 4, *length - 2);
    if (*marker == app1 && starts_with(payload, exif_header)) {
      return tiff_facts(payload.subspan(exif_header.size()));
    }
    at += 2 + std::size_t{*length};
  }
  return {};
}

ExifFacts png_facts(Bytes file) {
  constexpr std::size_t signature_size = 8;
  constexpr std::size_t chunk_overhead = 12;  // length, type, checksum
  const Reader reader(file, false);
  std::size_t at = signature_size;
  while (const auto length = reader.u32(at)) {
    if (file.size() - at < chunk_overhead || file.size() - at - chunk_overhead < *length) break;
    if (starts_with(file.subspan(at + 4), "eXIf")) return tiff_facts(file.subspan(at + 8, *length));
    at += chunk_overhead + std::size_t{*length};
  }
  return {};
}

}  // namespace

ExifFacts read_exif(std::span<const std::byte> file) {
  if (starts_with(file, "\xff\xd8")) return jpeg_facts(file);
  if (starts_with(file, "\x89PNG\r\n\x1a\n")) return png_facts(file);
  return {};
}

}  // namespace gyre
