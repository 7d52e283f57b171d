// SPDX-License-Identifier: Apache-2.0
#include "offload/body/npz.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <zlib.h>
#include <random>

namespace gyre {
namespace {

std::string little(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  return bytes;
}

std::string npy(const std::string& type, const std::string& shape, const std::string& data) {
  const std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }\n";
  return std::string("\x93NUMPY\x01\x00", 8) + little(static_cast<std::uint32_t>(header.size()), 2) + header + data;
}

std::string deflated(const std::string& content) {
  std::string packed(content.size() + 100, '\0');
  z_stream stream{};
  deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

// A ZIP archive of the members, deflated when `deflate`.
std::string zip(const std::vector<std::pair<std::string, std::string>>& members, bool deflate) {
  std::string body, directory;
  for (const auto& [name, content] : members) {
    const std::string packed = deflate ? deflated(content) : content;
    const auto crc = static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
    const std::string common = little(20, 2) + little(0, 2) + little(deflate ? 8 : 0, 2) + little(0, 4) +
                               little(crc, 4) + little(static_cast<std::uint32_t>(packed.size()), 4) +
                               little(static_cast<std::uint32_t>(content.size()), 4) +
                               little(static_cast<std::uint32_t>(name.size()), 2) + little(0, 2);
    directory += "PK\x01\x02" + little(20, 2) + common + little(0, 2) + little(0, 2) + little(0, 2) + little(0, 4) +
                 little(static_cast<std::uint32_t>(body.size()), 4) + name;
    body += "PK\x03\x04" + common + name + packed;
  }
  const auto count = static_cast<std::uint32_t>(members.size());
  return body + directory + "PK\x05\x06" + little(0, 4) + little(count, 2) + little(count, 2) +
         little(static_cast<std::uint32_t>(directory.size()), 4) + little(static_cast<std::uint32_t>(body.size()), 4) +
         little(0, 2);
}

const std::vector<std::pair<std::string, std::string>>& sample() {
  static const std::vector<std::pair<std::string, std::string>> members = {
      {"bytes.npy", npy("|u1", "(3,)", "abc")},
      {"index.npy", npy("<u2", "(2,)", little(7, 2) + little(65535, 2))},
      {"delta.npy", npy("<i2", "(2,)", little(0xFFFF, 2) + little(300, 2))},
      {"start.npy", npy("<i4", "(1,)", little(100000, 4))},
      {"table.npy", npy("<f4", "(2, 1)", little(0x3FC00000, 4) + little(0xC0000000, 4))}};
  return members;
}

Result<NpzArrays> read(const std::string& content) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "a.npz";
  std::ofstream(file, std::ios::binary) << content;
  return read_npz(file);
}

TEST(Npz, ReadsStoredAndDeflatedArrays) {
  for (const bool deflate : {false, true}) {
    const auto arrays = read(zip(sample(), deflate));
    ASSERT_TRUE(arrays) << arrays.error().message();
    EXPECT_EQ(arrays->integers.at("bytes"), (std::vector<std::int32_t>{'a', 'b', 'c'}));
    EXPECT_EQ(arrays->integers.at("index"), (std::vector<std::int32_t>{7, 65535}));
    EXPECT_EQ(arrays->integers.at("delta"), (std::vector<std::int32_t>{-1, 300}));
    EXPECT_EQ(arrays->integers.at("start"), (std::vector<std::int32_t>{100000}));
    EXPECT_EQ(arrays->reals.at("table"), (std::vector<float>{1.5F, -2.0F}));
  }
}

TEST(Npz, RefusesWhatItCannotRead) {
  EXPECT_FALSE(read(""));
  EXPECT_FALSE(read("not an archive"));
  EXPECT_FALSE(read(zip({{"a.npy", npy("<f8", "(1,)", little(0, 8))}}, true)));
  EXPECT_FALSE(read(zip({{"a.npy", npy("|u1", "(4,)", "abc")}}, true)));
  EXPECT_FALSE(read(zip({{"a.npy", npy("|u1", "(2, 3)", "abc")}}, true)));
  EXPECT_FALSE(read(zip({{"a.npy", npy("|u1", "()", "")}}, true)));
  EXPECT_FALSE(read(zip({{"a.npy", npy("|u1", "(99999999999, 99999999999)", "abc")}}, true)));
  EXPECT_FALSE(read(zip({{"a.txt", "hello"}}, true)));
}

TEST(Npz, DamageIsAnErrorNotACrash) {
  const std::string whole = zip(sample(), true);
  for (std::size_t length = 0; length + 2 < whole.size(); length += 3) EXPECT_FALSE(read(whole.substr(0, length)));
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = whole;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    (void)read(damaged);
  }
}

}  // namespace
}  // namespace gyre
