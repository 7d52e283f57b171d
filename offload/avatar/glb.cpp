// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/glb.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

namespace gyre {

namespace {

using Json = nlohmann::ordered_json;  // keys stay in the order they are written in

static_assert(std::endian::native == std::endian::little, "glTF buffers are little endian");

// Numbers of the glTF 2.0 specification.
constexpr int array_buffer = 34962;
constexpr int element_array_buffer = 34963;
constexpr int type_unsigned_byte = 5121;
constexpr int type_unsigned_int = 5125;
constexpr int type_float = 5126;
constexpr int filter_linear = 9729;
constexpr int filter_linear_mipmap_linear = 9987;
constexpr int wrap_clamp = 33071;

// The binary chunk and the views and accessors into it.
class Buffer {
 public:
  // Returns the view's index. target 0: none, as images and inverse bind matrices want it.
  int add_view(std::span<const std::byte> bytes, int target) {
    while (bytes_.size() % 4 != 0) bytes_.push_back(std::byte{0});
    Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) view["target"] = target;
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    views_.push_back(std::move(view));
    return static_cast<int>(views_.size()) - 1;
  }

  int add_accessor(std::span<const std::byte> bytes, int target, int component, const char* type, std::size_t count) {
    accessors_.push_back(
        {{"bufferView", add_view(bytes, target)}, {"componentType", component}, {"count", count}, {"type", type}});
    return static_cast<int>(accessors_.size()) - 1;
  }

  int add_vectors(std::span<const Eigen::Vector3f> values, bool bounded) {
    const int accessor = add_accessor(std::as_bytes(values), array_buffer, type_float, "VEC3", values.size());
    if (!bounded) return accessor;
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
    Eigen::Vector3f high = -low;
    for (const Eigen::Vector3f& v : values) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    accessors_[accessor]["min"] = {low.x(), low.y(), low.z()};
    accessors_[accessor]["max"] = {high.x(), high.y(), high.z()};
    return accessor;
  }

  const std::vector<std::byte>& bytes() const { return bytes_; }
  const Json& views() const { return views_; }
  const Json& accessors() const { return accessors_; }

 private:
  std::vector<std::byte> bytes_;
  Json views_ = Json::array();
  Json accessors_ = Json::array();
};

Json write_primitive(const Avatar& avatar, Buffer& buffer) {
  Json attributes;
  attributes["POSITION"] = buffer.add_vectors(avatar.positions, true);
  attributes["NORMAL"] = buffer.add_vectors(avatar.normals, false);
  if (!avatar.tangents.empty())
    attributes["TANGENT"] = buffer.add_accessor(std::as_bytes(std::span(avatar.tangents)), array_buffer, type_float,
                                                "VEC4", avatar.tangents.size());
  attributes["TEXCOORD_0"] =
      buffer.add_accessor(std::as_bytes(std::span(avatar.uv)), array_buffer, type_float, "VEC2", avatar.uv.size());
  std::vector<std::array<std::uint8_t, 4>> joints;
  std::vector<std::array<float, 4>> weights;
  for (const SkinWeights& s : avatar.skin) {
    auto& joint = joints.emplace_back();
    for (int k = 0; k < 4; ++k) joint[k] = static_cast<std::uint8_t>(s.joint[k]);
    weights.push_back(s.weight);
  }
  attributes["JOINTS_0"] =
      buffer.add_accessor(std::as_bytes(std::span(joints)), array_buffer, type_unsigned_byte, "VEC4", joints.size());
  attributes["WEIGHTS_0"] =
      buffer.add_accessor(std::as_bytes(std::span(weights)), array_buffer, type_float, "VEC4", weights.size());

  std::vector<std::uint32_t> indices;
  for (const Eigen::Vector3i& t : avatar.triangles) {
    for (int k = 0; k < 3; ++k) indices.push_back(static_cast<std::uint32_t>(t[k]));
  }
  Json primitive = {{"attributes", attributes}};
  primitive["indices"] = buffer.add_accessor(std::as_bytes(std::span(indices)), element_array_buffer, type_unsigned_int,
                                             "SCALAR", indices.size());
  primitive["material"] = 0;
  primitive["mode"] = 4;
  for (const AvatarMorph& morph : avatar.morphs) {
    primitive["targets"].push_back({{"POSITION", buffer.add_vectors(morph.positions, true)},
                                    {"NORMAL", buffer.add_vectors(morph.normals, false)}});
  }
  return primitive;
}

// Joints as nodes 0 to n-1, in the avatar's order; node n is the mesh.
Json write_nodes(const Avatar& avatar) {
  Json nodes = Json::array();
  for (std::size_t j = 0; j < avatar.joints.size(); ++j) {
    const AvatarJoint& joint = avatar.joints[j];
    const Eigen::Vector3d parent =
        joint.parent >= 0 ? avatar.joints[joint.parent].position : Eigen::Vector3d(Eigen::Vector3d::Zero());
    const Eigen::Vector3d local = joint.position - parent;
    Json node = {{"name", joint.name}, {"translation", {local.x(), local.y(), local.z()}}};
    for (std::size_t c = 0; c < avatar.joints.size(); ++c) {
      if (avatar.joints[c].parent == static_cast<int>(j)) node["children"].push_back(c);
    }
    nodes.push_back(std::move(node));
  }
  nodes.push_back({{"name", "avatar"}, {"mesh", 0}, {"skin", 0}});
  return nodes;
}

Json write_skin(const Avatar& avatar, Buffer& buffer) {
  // The joints' axes are the world's, so each inverse is a translation.
  std::vector<std::array<float, 16>> inverse_bind;
  Json joints = Json::array();
  int root = 0;
  for (std::size_t j = 0; j < avatar.joints.size(); ++j) {
    const Eigen::Vector3f p = avatar.joints[j].position.cast<float>();
    inverse_bind.push_back({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -p.x(), -p.y(), -p.z(), 1});
    joints.push_back(j);
    if (avatar.joints[j].parent < 0) root = static_cast<int>(j);
  }
  return {{"name", "skeleton"},
          {"inverseBindMatrices",
           buffer.add_accessor(std::as_bytes(std::span(inverse_bind)), 0, type_float, "MAT4", inverse_bind.size())},
          {"skeleton", root},
          {"joints", joints}};
}

// Pictures and the textures made of them, all sampled alike.
class Textures {
 public:
  // What a material says of the new texture.
  Json add(const char* name, const std::string& type, const std::vector<std::byte>& file, Buffer& buffer) {
    images_.push_back({{"name", name}, {"mimeType", type}, {"bufferView", buffer.add_view(file, 0)}});
    return {{"index", images_.size() - 1}};
  }

  void write(Json& gltf) const {
    if (images_.empty()) return;
    gltf["images"] = images_;
    gltf["samplers"] = Json::array({{{"magFilter", filter_linear},
                                     {"minFilter", filter_linear_mipmap_linear},
                                     {"wrapS", wrap_clamp},
                                     {"wrapT", wrap_clamp}}});
    for (std::size_t i = 0; i < images_.size(); ++i) gltf["textures"].push_back({{"sampler", 0}, {"source", i}});
  }

 private:
  Json images_ = Json::array();
};

void append(std::vector<std::byte>& out, std::uint32_t value) {
  const auto bytes = std::bit_cast<std::array<std::byte, 4>>(value);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> pack(const std::string& json, const std::vector<std::byte>& binary) {
  const auto padded = [](std::size_t n) { return (n + 3) / 4 * 4; };
  const std::size_t total = 12 + 8 + padded(json.size()) + 8 + padded(binary.size());
  std::vector<std::byte> out;
  out.reserve(total);
  append(out, 0x46546C67);  // "glTF"
  append(out, 2);
  append(out, static_cast<std::uint32_t>(total));
  append(out, static_cast<std::uint32_t>(padded(json.size())));
  append(out, 0x4E4F534A);  // "JSON"
  const auto text = std::as_bytes(std::span(json));
  out.insert(out.end(), text.begin(), text.end());
  out.resize(20 + padded(json.size()), std::byte{' '});
  append(out, static_cast<std::uint32_t>(padded(binary.size())));
  append(out, 0x004E4942);  // "BIN"
  out.insert(out.end(), binary.begin(), binary.end());
  out.resize(total, std::byte{0});
  return out;
}

}  // namespace

std::vector<std::byte> write_glb(const Avatar& avatar, const Json& extensions) {
  Buffer buffer;
  Json mesh = {{"name", "avatar"}};
  mesh["primitives"].push_back(write_primitive(avatar, buffer));
  if (!avatar.morphs.empty()) {
    mesh["weights"] = std::vector<double>(avatar.morphs.size(), 0.0);
    for (const AvatarMorph& morph : avatar.morphs) mesh["extras"]["targetNames"].push_back(morph.name);
  }
  const Json skin = write_skin(avatar, buffer);

  Json roots = Json::array();
  for (std::size_t j = 0; j < avatar.joints.size(); ++j) {
    if (avatar.joints[j].parent < 0) roots.push_back(j);
  }
  roots.push_back(avatar.joints.size());

  Json material = {{"name", "skin"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
  Json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "Gyre " GYRE_VERSION}, {"extras", avatar.facts}};
  if (!extensions.is_null()) {
    for (const auto& [name, unused] : extensions.items()) gltf["extensionsUsed"].push_back(name);
    gltf["extensions"] = extensions;
  }
  gltf["scene"] = 0;
  gltf["scenes"] = Json::array({{{"nodes", roots}}});
  gltf["nodes"] = write_nodes(avatar);
  gltf["meshes"] = Json::array({mesh});
  gltf["skins"] = Json::array({skin});
  Textures textures;
  if (!avatar.texture.empty())
    material["pbrMetallicRoughness"]["baseColorTexture"] =
        textures.add("albedo", avatar.texture_type, avatar.texture, buffer);
  if (!avatar.normal_map.empty())
    material["normalTexture"] = textures.add("normal", "image/png", avatar.normal_map, buffer);
  textures.write(gltf);
  gltf["materials"] = Json::array({material});
  gltf["accessors"] = buffer.accessors();
  gltf["bufferViews"] = buffer.views();
  gltf["buffers"] = Json::array({{{"byteLength", buffer.bytes().size()}}});
  return pack(gltf.dump(), buffer.bytes());
}

}  // namespace gyre
