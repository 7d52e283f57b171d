// SPDX-License-Identifier: Apache-2.0
// The tree of records that a binary FBX 7.4 file is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// A record: a name, properties, and records within. Properties are kept in the bytes they are written as.
class FbxNode {
 public:
  explicit FbxNode(std::string name) : name_(std::move(name)) {}

  // Each appends a property and returns the node.
  FbxNode& add(bool value);
  FbxNode& add(std::int32_t value);
  FbxNode& add(std::int64_t value);
  FbxNode& add(double value);
  FbxNode& add(std::string_view value);
  FbxNode& add(const char* value) { return add(std::string_view(value)); }
  // Arrays are compressed by zlib.
  FbxNode& add(std::span<const std::int32_t> values);
  FbxNode& add(std::span<const double> values);
  FbxNode& add_bytes(std::span<const std::byte> values);

  // Appends a record within this one, with properties of its own. The reference is good until the next child.
  template <class... Properties>
  FbxNode& child(std::string name, const Properties&... properties) {
    FbxNode& made = children_.emplace_back(std::move(name));
    (made.add(properties), ...);
    return made;
  }
  FbxNode& child(FbxNode node) { return children_.emplace_back(std::move(node)); }

  const std::vector<FbxNode>& children() const { return children_; }

 private:
  friend std::vector<std::byte> write_fbx_file(const std::vector<FbxNode>& records);
  void write(std::vector<std::byte>& out) const;

  std::string name_;
  std::uint32_t property_count_ = 0;
  std::vector<std::byte> properties_;
  std::vector<FbxNode> children_;
};

// The bytes of a whole file of version 7.4 with these records at its top.
std::vector<std::byte> write_fbx_file(const std::vector<FbxNode>& records);

}  // namespace gyre
