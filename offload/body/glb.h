// SPDX-License-Identifier: Apache-2.0
// Binary glTF 2.0 containers: one JSON document and one buffer, and typed arrays in it.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// Numbers the glTF specification gives to component types and buffer view targets.
namespace gltf {
enum Component { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
enum Target { none = 0, array_buffer = 34962, element_array_buffer = 34963 };
}  // namespace gltf

template <class T>
constexpr int component_type() {
  if constexpr (std::is_same_v<T, float>) return gltf::f32;
  if constexpr (std::is_same_v<T, std::uint32_t>) return gltf::u32;
  if constexpr (std::is_same_v<T, std::uint16_t>) return gltf::u16;
  if constexpr (std::is_same_v<T, std::int16_t>) return gltf::i16;
  if constexpr (std::is_same_v<T, std::uint8_t>) return gltf::u8;
}

// Builds a GLB: json is filled by the caller, arrays through the functions.
struct GlbWriter {
  nlohmann::json json = {{"asset", {{"version", "2.0"}, {"generator", "gyre " GYRE_VERSION}}}};

  // Index of a new buffer view that holds these values; views start at multiples of 4.
  template <class T>
  int add_view(const std::vector<T>& values, gltf::Target target = gltf::none) {
    return add_bytes({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)}, target);
  }
  // Index of a new accessor of `type` ("SCALAR", "VEC3", ...) on a new view of `values`.
  template <class T>
  int add_accessor(const std::vector<T>& values, const std::string& type, int width, gltf::Target target = gltf::none) {
    const int view = add_view(values, target);
    json["accessors"].push_back({{"bufferView", view},
                                 {"componentType", component_type<T>()},
                                 {"count", values.size() / static_cast<std::size_t>(width)},
                                 {"type", type}});
    return static_cast<int>(json["accessors"].size()) - 1;
  }
  int add_bytes(std::string_view bytes, gltf::Target target);

  // What the views hold so far.
  const std::string& binary() const { return binary_; }

  Result<void> write(const std::filesystem::path& file);

 private:
  std::string binary_;
};

// A parsed GLB. Files are outside input: reading an array checks every offset and type.
class GlbReader {
 public:
  static Result<GlbReader> open(const std::filesystem::path& file);

  const nlohmann::json& json() const { return json_; }

  // Values of a buffer view, which must hold a whole number of them.
  template <class T>
  Result<std::vector<T>> view(const nlohmann::json& index) const {
    const auto bytes = view_bytes(index);
    if (!bytes) return tl::unexpected(bytes.error());
    return values<T>(*bytes, index);
  }

  // Values of a tightly packed accessor with the given component type, `width` numbers an element.
  template <class T>
  Result<std::vector<T>> accessor(const nlohmann::json& index, int width) const {
    const auto bytes = accessor_bytes(index, component_type<T>(), sizeof(T) * static_cast<std::size_t>(width), width);
    if (!bytes) return tl::unexpected(bytes.error());
    return values<T>(*bytes, index);
  }

  const std::string& binary() const { return binary_; }

  // The file's name for errors.
  const std::string& where() const { return where_; }

 private:
  template <class T>
  Result<std::vector<T>> values(std::string_view bytes, const nlohmann::json& index) const {
    if (bytes.size() % sizeof(T) != 0) return fail("array of broken elements", where_ + " " + index.dump());
    std::vector<T> read(bytes.size() / sizeof(T));
    if (!read.empty()) std::memcpy(read.data(), bytes.data(), bytes.size());
    return read;
  }
  Result<std::string_view> view_bytes(const nlohmann::json& index) const;
  Result<std::string_view> accessor_bytes(const nlohmann::json& index, int component, std::size_t element_size,
                                          int width) const;

  nlohmann::json json_;
  std::string binary_;
  std::string where_;
};

}  // namespace gyre
