// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/fbx_node.h"

#include <zlib.h>
#include <array>
#include <bit>
#include <cstring>
#include <new>

namespace gyre {

namespace {

static_assert(std::endian::native == std::endian::little, "FBX files are little endian");

constexpr std::uint32_t version = 7400;
constexpr std::size_t null_record = 13;  // zeros that end a list of records

template <class T>
void append(std::vector<std::byte>& out, const T& value) {
  const std::size_t at = out.size();
  out.resize(at + sizeof value);
  std::memcpy(out.data() + at, &value, sizeof value);
}

void append_bytes(std::vector<std::byte>& out, std::span<const std::byte> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void append_zeros(std::vector<std::byte>& out, std::size_t count) {
  out.resize(out.size() + count, std::byte{0});
}

void append_array(std::vector<std::byte>& out, char type, std::size_t count, std::span<const std::byte> bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::vector<std::byte> packed(size);
  // The bound leaves no way to fail but want of memory.
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uLong>(bytes.size()), Z_BEST_SPEED) != Z_OK)
    throw std::bad_alloc();
  append(out, type);
  append(out, static_cast<std::uint32_t>(count));
  append(out, std::uint32_t{1});  // zlib
  append(out, static_cast<std::uint32_t>(size));
  append_bytes(out, std::span(packed).first(size));
}

}  // namespace

FbxNode& FbxNode::add(bool value) {
  ++property_count_;
  append(properties_, 'C');
  append(properties_, static_cast<std::uint8_t>(value ? 1 : 0));
  return *this;
}

FbxNode& FbxNode::add(std::int32_t value) {
  ++property_count_;
  append(properties_, 'I');
  append(properties_, value);
  return *this;
}

FbxNode& FbxNode::add(std::int64_t value) {
  ++property_count_;
  append(properties_, 'L');
  append(properties_, value);
  return *this;
}

FbxNode& FbxNode::add(double value) {
  ++property_count_;
  append(properties_, 'D');
  append(properties_, value);
  return *this;
}

FbxNode& FbxNode::add(std::string_view value) {
  ++property_count_;
  append(properties_, 'S');
  append(properties_, static_cast<std::uint32_t>(value.size()));
  append_bytes(properties_, std::as_bytes(std::span(value)));
  return *this;
}

FbxNode& FbxNode::add(std::span<const std::int32_t> values) {
  ++property_count_;
  append_array(properties_, 'i', values.size(), std::as_bytes(values));
  return *this;
}

FbxNode& FbxNode::add(std::span<const double> values) {
  ++property_count_;
  append_array(properties_, 'd', values.size(), std::as_bytes(values));
  return *this;
}

FbxNode& FbxNode::add_bytes(std::span<const std::byte> values) {
  ++property_count_;
  append(properties_, 'R');
  append(properties_, static_cast<std::uint32_t>(values.size()));
  append_bytes(properties_, values);
  return *this;
}

void FbxNode::write(std::vector<std::byte>& out) const {
  const std::size_t begin = out.size();
  append(out, std::uint32_t{0});  // where the record ends, once it is known
  append(out, property_count_);
  append(out, static_cast<std::uint32_t>(properties_.size()));
  append(out, static_cast<std::uint8_t>(name_.size()));
  append_bytes(out, std::as_bytes(std::span(name_)));
  append_bytes(out, properties_);
  for (const FbxNode& node : children_) node.write(out);
  if (!children_.empty() || property_count_ == 0) append_zeros(out, null_record);
  const auto end = static_cast<std::uint32_t>(out.size());
  std::memcpy(out.data() + begin, &end, sizeof end);
}

std::vector<std::byte> write_fbx_file(const std::vector<FbxNode>& records) {
  using namespace std::literals;
  // What every file ends with; readers compare some of it.
  constexpr std::array<std::uint8_t, 16> before_padding = {0xfa, 0xbc, 0xab, 0x09, 0xd0, 0xc8, 0xd4, 0x66,
                                                           0xb1, 0x76, 0xfb, 0x83, 0x1c, 0xf7, 0x26, 0x7e};
  constexpr std::array<std::uint8_t, 16> last = {0xf8, 0x5a, 0x8c, 0x6a, 0xde, 0xf5, 0xd9, 0x7e,
                                                 0xec, 0xe9, 0x0c, 0xe3, 0x75, 0x8f, 0x29, 0x0b};
  const auto magic = std::as_bytes(std::span("Kaydara FBX Binary  \0\x1a\0"sv));
  std::vector<std::byte> out(magic.begin(), magic.end());
  append(out, version);
  for (const FbxNode& record : records) record.write(out);
  append_zeros(out, null_record);
  append(out, before_padding);
  append_zeros(out, 4);
  append_zeros(out, 16 - out.size() % 16);
  append(out, version);
  append_zeros(out, 120);
  append(out, last);
  return out;
}

}  // namespace gyre
