// SPDX-License-Identifier: Apache-2.0
#include "offload/body/glb.h"

#include "common/bundle/atomic_file.h"

#include <array>

namespace gyre {
namespace {

constexpr std::uint32_t magic = 0x46546C67, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;

void append_number(std::string& bytes, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<std::uint8_t>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}

// A count or offset of the JSON, or nothing when it is missing, negative or not a whole number.
std::optional<std::size_t> whole(const nlohmann::json& object, const char* key, std::optional<std::size_t> missing) {
  const auto found = object.find(key);
  if (found == object.end()) return missing;
  if (!found->is_number_unsigned()) return std::nullopt;
  return found->get<std::size_t>();
}

const nlohmann::json* element(const nlohmann::json& json, const char* list, const nlohmann::json& index) {
  const auto found = json.find(list);
  if (found == json.end() || !found->is_array() || !index.is_number_unsigned()) return nullptr;
  const auto at = index.get<std::size_t>();
  return at < found->size() && (*found)[at].is_object() ? &(*found)[at] : nullptr;
}

}  // namespace

int GlbWriter::add_bytes(std::string_view bytes, gltf::Target target) {
  nlohmann::json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
  if (target != gltf::none) view["target"] = static_cast<int>(target);
  json["bufferViews"].push_back(std::move(view));
  binary_ += bytes;
  while (binary_.size() % 4 != 0) binary_ += '\0';
  return static_cast<int>(json["bufferViews"].size()) - 1;
}

Result<void> GlbWriter::write(const std::filesystem::path& file) {
  json["buffers"] = nlohmann::json::array({{{"byteLength", binary_.size()}}});
  std::string text = json.dump();
  while (text.size() % 4 != 0) text += ' ';
  std::string bytes;
  append_number(bytes, magic);
  append_number(bytes, 2);
  append_number(bytes, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary_.size()));
  append_number(bytes, static_cast<std::uint32_t>(text.size()));
  append_number(bytes, json_chunk);
  bytes += text;
  append_number(bytes, static_cast<std::uint32_t>(binary_.size()));
  append_number(bytes, binary_chunk);
  bytes += binary_;
  return write_file(file, std::string_view(bytes));
}

Result<GlbReader> GlbReader::open(const std::filesystem::path& file) {
  const Result<std::string> content = read_file(file);
  if (!content) return tl::unexpected(content.error());
  const std::string_view bytes = *content;
  GlbReader reader;
  reader.where_ = file.string();
  if (bytes.size() < 20 || number_at(bytes, 0) != magic || number_at(bytes, 4) != 2)
    return fail("not a GLB file of version 2", reader.where_);
  const std::size_t json_size = number_at(bytes, 12);
  if (number_at(bytes, 8) != bytes.size() || number_at(bytes, 16) != json_chunk || json_size > bytes.size() - 20)
    return fail("damaged GLB file", reader.where_, "build or fetch it again");
  const std::string_view rest = bytes.substr(20 + json_size);
  if (rest.size() < 8 || number_at(rest, 4) != binary_chunk || number_at(rest, 0) != rest.size() - 8)
    return fail("GLB file without its buffer", reader.where_, "build or fetch it again");
  reader.json_ = nlohmann::json::parse(bytes.substr(20, json_size), nullptr, false);
  if (!reader.json_.is_object()) return fail("GLB file with broken JSON", reader.where_, "build or fetch it again");
  reader.binary_ = rest.substr(8);
  return reader;
}

Result<std::string_view> GlbReader::view_bytes(const nlohmann::json& index) const {
  const nlohmann::json* view = element(json_, "bufferViews", index);
  if (!view) return fail("no such buffer view", where_ + " " + index.dump());
  const auto offset = whole(*view, "byteOffset", 0), length = whole(*view, "byteLength", std::nullopt);
  if (!offset || !length || *offset > binary_.size() || *length > binary_.size() - *offset ||
      view->contains("byteStride"))
    return fail("buffer view outside the buffer", where_ + " " + index.dump());
  return std::string_view(binary_).substr(*offset, *length);
}

Result<std::string_view> GlbReader::accessor_bytes(const nlohmann::json& index, int component, std::size_t element_size,
                                                   int width) const {
  static const std::array<std::pair<std::string_view, int>, 5> types = {
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}}};
  const nlohmann::json* accessor = element(json_, "accessors", index);
  if (!accessor || !accessor->contains("bufferView")) return fail("no such accessor", where_ + " " + index.dump());
  const auto count = whole(*accessor, "count", std::nullopt), offset = whole(*accessor, "byteOffset", 0);
  const nlohmann::json type = accessor->value("type", nlohmann::json());
  const bool fits = std::any_of(types.begin(), types.end(),
                                [&](const auto& t) { return type == nlohmann::json(t.first) && t.second == width; });
  const auto bytes = view_bytes((*accessor)["bufferView"]);
  if (!bytes) return bytes;
  if (!count || !offset || accessor->value("componentType", nlohmann::json()) != nlohmann::json(component) || !fits ||
      *offset > bytes->size() || *count > (bytes->size() - *offset) / element_size)
    return fail("accessor of the wrong kind or size", where_ + " " + index.dump());
  return bytes->substr(*offset, *count * element_size);
}

}  // namespace gyre
