// SPDX-License-Identifier: Apache-2.0
#include "offload/body/npz.h"

#include "common/bundle/atomic_file.h"

#include <zlib.h>
#include <cstring>

namespace gyre {
namespace {

// Little-endian numbers of an archive; what lies outside it reads as 0 and clears `good`.
struct Bytes {
  std::string_view data;
  bool good = true;

  std::uint32_t number(std::size_t at, int size) {
    if (at > data.size() || data.size() - at < static_cast<std::size_t>(size)) {
      good = false;
      return 0;
    }
    std::uint32_t value = 0;
    for (int i = size - 1; i >= 0; --i) value = value << 8 | static_cast<std::uint8_t>(data[at + i]);
    return value;
  }
  std::string_view slice(std::size_t at, std::size_t size) {
    if (at > data.size() || data.size() - at < size) {
      good = false;
      return {};
    }
    return data.substr(at, size);
  }
};

constexpr std::uint32_t end_of_directory = 0x06054b50, directory_entry = 0x02014b50, local_entry = 0x04034b50;
constexpr std::size_t largest_member = std::size_t{1} << 28;

bool inflate_raw(std::string_view packed, std::string& unpacked) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  stream.avail_out = static_cast<uInt>(unpacked.size());
  const int status = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  return status == Z_STREAM_END && stream.avail_out == 0;
}

// Value of a key of the header, a Python dictionary literal as NumPy writes it.
std::string_view header_value(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(key);
  if (at == std::string_view::npos) return {};
  const std::size_t start = header.find_first_not_of(": '(", at + key.size());
  if (start == std::string_view::npos) return {};
  return header.substr(start, header.find_first_of("',)", start) - start);
}

// Number of values of a shape like "(3, 4)" or "(3,)"; 0 for anything else.
std::size_t value_count(std::string_view header) {
  const std::size_t at = header.find("'shape'"), open = header.find('(', at), close = header.find(')', at);
  if (at == std::string_view::npos || open == std::string_view::npos || close == std::string_view::npos) return 0;
  std::istringstream sizes{std::string(header.substr(open + 1, close - open - 1))};
  std::size_t count = 1, size = 0, dimensions = 0;
  char comma = 0;
  while (sizes >> size) {
    if (size > largest_member || count * size > largest_member) return 0;
    count *= size;
    ++dimensions;
    sizes >> comma;
  }
  return dimensions > 0 ? count : 0;
}

Result<void> read_npy(std::string_view content, const std::string& name, const std::string& where, NpzArrays& arrays) {
  Bytes bytes{content};
  const bool magic = bytes.slice(0, 6) == std::string_view("\x93NUMPY", 6);
  const std::size_t header_size = bytes.number(8, 2);
  const std::string_view header = bytes.slice(10, header_size);
  if (!magic || !bytes.good || content[6] != 1) return fail("not a NumPy array of version 1", where);
  if (header_value(header, "'fortran_order'") != "False") return fail("array in Fortran order", where);
  const std::string_view type = header_value(header, "'descr'");
  const std::string_view data = content.substr(10 + header_size);
  const std::size_t count = value_count(header);
  const auto widen = [&]<class From, class To>(From, std::vector<To>& values) -> Result<void> {
    if (count == 0 || data.size() != count * sizeof(From)) return fail("array is not complete", where);
    values.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      From value;
      std::memcpy(&value, data.data() + i * sizeof(From), sizeof(From));
      values[i] = static_cast<To>(value);
    }
    return {};
  };
  if (type == "|u1") return widen(std::uint8_t{}, arrays.integers[name]);
  if (type == "<u2") return widen(std::uint16_t{}, arrays.integers[name]);
  if (type == "<i2") return widen(std::int16_t{}, arrays.integers[name]);
  if (type == "<i4") return widen(std::int32_t{}, arrays.integers[name]);
  if (type == "<f4") return widen(float{}, arrays.reals[name]);
  return fail("array of an unknown type", where);
}

}  // namespace

Result<NpzArrays> read_npz(const std::filesystem::path& file) {
  const Result<std::string> content = read_file(file);
  if (!content) return tl::unexpected(content.error());
  Bytes archive{*content};
  const std::string signature = {'P', 'K', 5, 6};
  const std::size_t end = content->rfind(signature);
  if (end == std::string::npos || archive.number(end, 4) != end_of_directory)
    return fail("not an NPZ archive", file.string());
  const std::size_t count = archive.number(end + 10, 2);
  std::size_t at = archive.number(end + 16, 4);
  if (!archive.good) return fail("damaged NPZ archive", file.string());

  NpzArrays arrays;
  for (std::size_t member = 0; member < count; ++member) {
    const std::size_t method = archive.number(at + 10, 2), crc = archive.number(at + 16, 4);
    const std::size_t packed_size = archive.number(at + 20, 4), size = archive.number(at + 24, 4);
    const std::size_t name_size = archive.number(at + 28, 2),
                      skip = archive.number(at + 30, 2) + archive.number(at + 32, 2);
    const std::size_t local = archive.number(at + 42, 4);
    const bool is_entry = archive.number(at, 4) == directory_entry && archive.number(local, 4) == local_entry;
    std::string name(archive.slice(at + 46, name_size));
    const std::size_t data = local + 30 + archive.number(local + 26, 2) + archive.number(local + 28, 2);
    const std::string_view packed = archive.slice(data, packed_size);
    const std::string where = file.string() + " member " + name;
    if (!archive.good || !is_entry || size > largest_member) return fail("damaged NPZ archive", where);
    at += 46 + name_size + skip;

    std::string unpacked(size, '\0');
    const bool unpacks = method == 0   ? packed.copy(unpacked.data(), size) == packed_size && packed_size == size
                         : method == 8 ? inflate_raw(packed, unpacked)
                                       : false;
    if (!unpacks || crc32(0, reinterpret_cast<const Bytef*>(unpacked.data()), static_cast<uInt>(size)) != crc)
      return fail("cannot unpack", where);
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    if (auto ok = read_npy(unpacked, name, where, arrays); !ok) return tl::unexpected(ok.error());
  }
  return arrays;
}

}  // namespace gyre
