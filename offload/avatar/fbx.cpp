// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/fbx.h"

#include "offload/avatar/fbx_node.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <numeric>

namespace gyre {

namespace {

constexpr double centimetres = 100.0;  // in a metre

using Matrix = std::array<double, 16>;  // column by column

Matrix translation(const Eigen::Vector3d& by) {
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, by.x(), by.y(), by.z(), 1};
}

// The name of an object as the binary form writes it.
std::string named(std::string_view name, std::string_view type) {
  return std::string(name) + std::string("\0\1", 2) + std::string(type);
}

template <class... Values>
void property(FbxNode& properties, const char* name, const char* type, const char* label, const char* flags,
              const Values&... values) {
  properties.child("P", name, type, label, flags, values...);
}

std::span<const double> all_of(const std::vector<double>& values) {
  return values;
}
std::span<const std::int32_t> all_of(const std::vector<std::int32_t>& values) {
  return values;
}
std::span<const double> all_of(const Matrix& values) {
  return values;
}

void add_triple(std::vector<double>& into, const Eigen::Vector3f& v, double scale = 1.0) {
  for (int k = 0; k < 3; ++k) into.push_back(scale * static_cast<double>(v[k]));
}

// Which vertices of the avatar are one but for their texture coordinates.
struct Welding {
  std::vector<int> welded_of;  // per vertex of the avatar
  std::vector<int> first_of;   // per welded vertex: one of the avatar's
};

bool same_vertex(const Avatar& avatar, int a, int b) {
  if (avatar.positions[a] != avatar.positions[b] || avatar.skin[a].joint != avatar.skin[b].joint ||
      avatar.skin[a].weight != avatar.skin[b].weight)
    return false;
  return std::all_of(avatar.morphs.begin(), avatar.morphs.end(),
                     [&](const AvatarMorph& m) { return m.positions[a] == m.positions[b]; });
}

Welding weld(const Avatar& avatar) {
  Welding welding;
  std::map<std::array<float, 3>, std::vector<int>> at;  // welded vertices at a place
  for (int v = 0; v < static_cast<int>(avatar.positions.size()); ++v) {
    const Eigen::Vector3f& p = avatar.positions[v];
    std::vector<int>& here = at[{p.x(), p.y(), p.z()}];
    const auto same =
        std::find_if(here.begin(), here.end(), [&](int w) { return same_vertex(avatar, welding.first_of[w], v); });
    if (same != here.end()) {
      welding.welded_of.push_back(*same);
    } else {
      here.push_back(static_cast<int>(welding.first_of.size()));
      welding.welded_of.push_back(here.back());
      welding.first_of.push_back(v);
    }
  }
  return welding;
}

class FbxWriter {
 public:
  explicit FbxWriter(const Avatar& avatar) : avatar_(avatar), welding_(weld(avatar)) {
    for (std::size_t j = 0; j < avatar.joints.size(); ++j) joint_ids_.push_back(next_id());
  }

  std::vector<std::byte> write() {
    write_geometry();
    write_mesh_model();
    write_skeleton();
    write_skin();
    write_expressions();
    write_bind_pose();
    write_material();
    return write_fbx_file({header(), file_id(), creation_time(), creator(), settings(), documents(),
                           FbxNode("References"), definitions(), objects_, connections_, takes()});
  }

 private:
  std::int64_t next_id() { return ++last_id_; }

  FbxNode& object(const char* kind, std::int64_t id, std::string_view name, const char* type, const char* subtype) {
    ++counts_[kind];
    return objects_.child(kind, id, std::string_view(named(name, type)), subtype);
  }

  void connect(std::int64_t child, std::int64_t parent) { connections_.child("C", "OO", child, parent); }

  void write_geometry() {
    FbxNode& geometry = object("Geometry", geometry_, "avatar", "Geometry", "Mesh");
    std::vector<double> vertices, normals, coordinates;
    for (const int v : welding_.first_of) add_triple(vertices, avatar_.positions[v], centimetres);
    std::vector<std::int32_t> corners, coordinate_of;
    for (const Eigen::Vector3i& t : avatar_.triangles)
      for (int k = 0; k < 3; ++k) {
        const int corner = welding_.welded_of[t[k]];
        corners.push_back(k == 2 ? -corner - 1 : corner);  // the last of a polygon is told by its sign
        add_triple(normals, avatar_.normals[t[k]]);
        coordinate_of.push_back(t[k]);
      }
    for (const Eigen::Vector2f& uv : avatar_.uv) {
      coordinates.push_back(uv.x());
      coordinates.push_back(1.0 - static_cast<double>(uv.y()));  // FBX counts from below
    }
    geometry.child("Properties70");
    geometry.child("GeometryVersion", std::int32_t{124});
    geometry.child("Vertices", all_of(vertices));
    geometry.child("PolygonVertexIndex", all_of(corners));
    add_layer(geometry, "LayerElementNormal", "", "ByPolygonVertex", "Direct").child("Normals", all_of(normals));
    std::vector<const char*> layers = {"LayerElementNormal", "LayerElementUV", "LayerElementMaterial"};
    if (!avatar_.tangents.empty()) {
      write_tangents(geometry);
      layers.insert(layers.begin() + 1, {"LayerElementBinormal", "LayerElementTangent"});
    }
    FbxNode& uv_layer = add_layer(geometry, "LayerElementUV", "UVMap", "ByPolygonVertex", "IndexToDirect");
    uv_layer.child("UV", all_of(coordinates));
    uv_layer.child("UVIndex", all_of(coordinate_of));
    add_layer(geometry, "LayerElementMaterial", "", "AllSame", "IndexToDirect")
        .child("Materials", all_of(std::vector<std::int32_t>{0}));
    FbxNode& layer = geometry.child("Layer", std::int32_t{0});
    layer.child("Version", std::int32_t{100});
    for (const char* element : layers) {
      FbxNode& entry = layer.child("LayerElement");
      entry.child("Type", element);
      entry.child("TypedIndex", std::int32_t{0});
    }
  }

  static FbxNode& add_layer(FbxNode& geometry, const char* element, const char* name, const char* mapping,
                            const char* reference) {
    FbxNode& layer = geometry.child(element, std::int32_t{0});
    layer.child("Version", std::int32_t{101});
    layer.child("Name", name);
    layer.child("MappingInformationType", mapping);
    layer.child("ReferenceInformationType", reference);
    return layer;
  }

  void write_tangents(FbxNode& geometry) const {
    std::vector<double> tangents, bitangents;
    for (const Eigen::Vector3i& t : avatar_.triangles)
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector4f& tangent = avatar_.tangents[t[k]];
        add_triple(tangents, tangent.head<3>());
        add_triple(bitangents, tangent[3] * avatar_.normals[t[k]].cross(tangent.head<3>()));
      }
    add_layer(geometry, "LayerElementBinormal", "UVMap", "ByPolygonVertex", "Direct")
        .child("Binormals", all_of(bitangents));
    add_layer(geometry, "LayerElementTangent", "UVMap", "ByPolygonVertex", "Direct")
        .child("Tangents", all_of(tangents));
  }

  void write_model(std::int64_t id, const std::string& name, const char* subtype, const Eigen::Vector3d& local) {
    FbxNode& model = object("Model", id, name, "Model", subtype);
    model.child("Version", std::int32_t{232});
    FbxNode& properties = model.child("Properties70");
    property(properties, "Lcl Translation", "Lcl Translation", "", "A", local.x(), local.y(), local.z());
    property(properties, "Lcl Rotation", "Lcl Rotation", "", "A", 0.0, 0.0, 0.0);
    property(properties, "Lcl Scaling", "Lcl Scaling", "", "A", 1.0, 1.0, 1.0);
    property(properties, "DefaultAttributeIndex", "int", "Integer", "", std::int32_t{0});
    property(properties, "InheritType", "enum", "", "", std::int32_t{1});  // scales of parents do not shear
    model.child("MultiLayer", std::int32_t{0});
    model.child("MultiTake", std::int32_t{0});
    model.child("Shading", true);
    model.child("Culling", "CullingOff");
  }

  void write_mesh_model() {
    write_model(mesh_, "avatar", "Mesh", Eigen::Vector3d::Zero());
    connect(mesh_, 0);
    connect(geometry_, mesh_);
  }

  void write_skeleton() {
    for (std::size_t j = 0; j < avatar_.joints.size(); ++j) {
      const AvatarJoint& joint = avatar_.joints[j];
      const std::int64_t attribute = next_id();
      FbxNode& node = object("NodeAttribute", attribute, joint.name, "NodeAttribute", "LimbNode");
      FbxNode& properties = node.child("Properties70");
      property(properties, "Size", "double", "Number", "", 1.0);
      node.child("TypeFlags", "Skeleton");
      Eigen::Vector3d local = joint.position;
      if (joint.parent >= 0) local -= avatar_.joints[joint.parent].position;
      write_model(joint_ids_[j], joint.name, "LimbNode", centimetres * local);
      connect(attribute, joint_ids_[j]);
      connect(joint_ids_[j], joint.parent < 0 ? 0 : joint_ids_[joint.parent]);
    }
  }

  void write_skin() {
    const std::int64_t skin = next_id();
    FbxNode& deformer = object("Deformer", skin, "skin", "Deformer", "Skin");
    deformer.child("Version", std::int32_t{101});
    deformer.child("Link_DeformAcuracy", 50.0);  // spelt so in the format
    connect(skin, geometry_);
    for (std::size_t j = 0; j < avatar_.joints.size(); ++j) {
      std::vector<std::int32_t> indices;
      std::vector<double> weights;
      for (std::size_t w = 0; w < welding_.first_of.size(); ++w) {
        const SkinWeights& of_vertex = avatar_.skin[welding_.first_of[w]];
        for (int k = 0; k < 4; ++k)
          if (of_vertex.joint[k] == static_cast<int>(j) && of_vertex.weight[k] > 0) {
            indices.push_back(static_cast<std::int32_t>(w));
            weights.push_back(of_vertex.weight[k]);
          }
      }
      const std::int64_t id = next_id();
      FbxNode& cluster = object("Deformer", id, avatar_.joints[j].name, "SubDeformer", "Cluster");
      cluster.child("Version", std::int32_t{100});
      cluster.child("UserData", "", "");
      if (!indices.empty()) {
        cluster.child("Indexes", all_of(indices));
        cluster.child("Weights", all_of(weights));
      }
      const Eigen::Vector3d at = centimetres * avatar_.joints[j].position;
      cluster.child("Transform", all_of(translation(-at)));
      cluster.child("TransformLink", all_of(translation(at)));
      connect(id, skin);
      connect(joint_ids_[j], id);
    }
  }

  void write_expressions() {
    if (avatar_.morphs.empty()) return;
    const std::int64_t blend = next_id();
    FbxNode& deformer = object("Deformer", blend, "expressions", "Deformer", "BlendShape");
    deformer.child("Version", std::int32_t{100});
    connect(blend, geometry_);
    std::vector<std::int32_t> every(welding_.first_of.size());
    std::iota(every.begin(), every.end(), 0);
    for (const AvatarMorph& morph : avatar_.morphs) {
      const std::int64_t channel = next_id(), shape = next_id();
      FbxNode& node = object("Deformer", channel, morph.name, "SubDeformer", "BlendShapeChannel");
      node.child("Version", std::int32_t{100});
      node.child("DeformPercent", 0.0);
      node.child("FullWeights", all_of(std::vector<double>{100.0}));
      connect(channel, blend);
      std::vector<double> offsets, normals;
      for (const int v : welding_.first_of) {
        add_triple(offsets, morph.positions[v], centimetres);
        add_triple(normals, morph.normals[v]);
      }
      FbxNode& geometry = object("Geometry", shape, morph.name, "Geometry", "Shape");
      geometry.child("Properties70");
      geometry.child("Version", std::int32_t{100});
      geometry.child("Indexes", all_of(every));
      geometry.child("Vertices", all_of(offsets));
      geometry.child("Normals", all_of(normals));
      connect(shape, channel);
    }
  }

  void write_bind_pose() {
    FbxNode& pose = object("Pose", next_id(), "bind", "Pose", "BindPose");
    pose.child("Type", "BindPose");
    pose.child("Version", std::int32_t{100});
    pose.child("NbPoseNodes", static_cast<std::int32_t>(1 + joint_ids_.size()));
    const auto add = [&](std::int64_t id, const Eigen::Vector3d& at) {
      FbxNode& node = pose.child("PoseNode");
      node.child("Node", id);
      node.child("Matrix", all_of(translation(at)));
    };
    add(mesh_, Eigen::Vector3d::Zero());
    for (std::size_t j = 0; j < joint_ids_.size(); ++j) add(joint_ids_[j], centimetres * avatar_.joints[j].position);
  }

  void write_material() {
    const std::int64_t material = next_id();
    FbxNode& node = object("Material", material, "skin", "Material", "");
    node.child("Version", std::int32_t{102});
    node.child("ShadingModel", "lambert");
    node.child("MultiLayer", std::int32_t{0});
    FbxNode& properties = node.child("Properties70");
    property(properties, "DiffuseColor", "Color", "", "A", 1.0, 1.0, 1.0);
    property(properties, "DiffuseFactor", "Number", "", "A", 1.0);
    connect(material, mesh_);
    if (!avatar_.texture.empty())
      write_texture("albedo", avatar_.texture_type == "image/jpeg" ? "albedo.jpg" : "albedo.png", avatar_.texture,
                    material, "DiffuseColor");
    if (!avatar_.normal_map.empty()) write_texture("normal", "normal.png", avatar_.normal_map, material, "NormalMap");
  }

  void write_texture(const char* name, const char* file, const std::vector<std::byte>& bytes, std::int64_t material,
                     const char* channel) {
    const std::int64_t video = next_id(), texture = next_id();
    FbxNode& clip = object("Video", video, name, "Video", "Clip");
    clip.child("Type", "Clip");
    FbxNode& clip_properties = clip.child("Properties70");
    property(clip_properties, "Path", "KString", "XRefUrl", "", file);
    clip.child("UseMipMap", std::int32_t{0});
    clip.child("Filename", file);
    clip.child("RelativeFilename", file);
    clip.child("Content").add_bytes(bytes);
    FbxNode& image = object("Texture", texture, name, "Texture", "");
    image.child("Type", "TextureVideoClip");
    image.child("Version", std::int32_t{202});
    image.child("TextureName", std::string_view(named(name, "Texture")));
    image.child("Media", std::string_view(named(name, "Video")));
    image.child("FileName", file);
    image.child("RelativeFilename", file);
    FbxNode& image_properties = image.child("Properties70");
    property(image_properties, "UVSet", "KString", "", "", "UVMap");
    property(image_properties, "UseMaterial", "bool", "", "", std::int32_t{1});
    connections_.child("C", "OP", texture, material, channel);
    connect(video, texture);
  }

  static FbxNode header() {
    FbxNode node("FBXHeaderExtension");
    node.child("FBXHeaderVersion", std::int32_t{1003});
    node.child("FBXVersion", std::int32_t{7400});
    node.child("EncryptionType", std::int32_t{0});
    FbxNode& stamp = node.child("CreationTimeStamp");  // the same for equal avatars
    stamp.child("Version", std::int32_t{1000});
    for (const auto& [name, value] : {std::pair("Year", 1970),
                                      {"Month", 1},
                                      {"Day", 1},
                                      {"Hour", 10},
                                      {"Minute", 0},
                                      {"Second", 0},
                                      {"Millisecond", 0}})
      stamp.child(name, std::int32_t{value});
    node.child("Creator", "Gyre " GYRE_VERSION);
    return node;
  }

  // Identifier and time belong together, as some readers check.
  static FbxNode file_id() {
    constexpr std::array<std::uint8_t, 16> id = {0x28, 0xb3, 0x2a, 0xeb, 0xb6, 0x24, 0xcc, 0xc2,
                                                 0xbf, 0xc8, 0xb0, 0x2a, 0xa9, 0x2b, 0xfc, 0xf1};
    FbxNode node("FileId");
    node.add_bytes(std::as_bytes(std::span(id)));
    return node;
  }
  static FbxNode creation_time() {
    FbxNode node("CreationTime");
    node.add("1970-01-01 10:00:00:000");
    return node;
  }
  static FbxNode creator() {
    FbxNode node("Creator");
    node.add("Gyre " GYRE_VERSION);
    return node;
  }

  static FbxNode settings() {
    FbxNode node("GlobalSettings");
    node.child("Version", std::int32_t{1000});
    FbxNode& properties = node.child("Properties70");
    for (const auto& [name, value] : {std::pair("UpAxis", 1),
                                      {"UpAxisSign", 1},
                                      {"FrontAxis", 2},
                                      {"FrontAxisSign", 1},
                                      {"CoordAxis", 0},
                                      {"CoordAxisSign", 1},
                                      {"OriginalUpAxis", 1},
                                      {"OriginalUpAxisSign", 1}})
      property(properties, name, "int", "Integer", "", std::int32_t{value});
    property(properties, "UnitScaleFactor", "double", "Number", "", 1.0);  // centimetres
    property(properties, "OriginalUnitScaleFactor", "double", "Number", "", 1.0);
    return node;
  }

  FbxNode documents() {
    FbxNode node("Documents");
    node.child("Count", std::int32_t{1});
    FbxNode& document = node.child("Document", next_id(), "Scene", "Scene");
    document.child("Properties70");
    document.child("RootNode", std::int64_t{0});
    return node;
  }

  FbxNode definitions() const {
    FbxNode node("Definitions");
    node.child("Version", std::int32_t{100});
    std::int32_t total = 1;
    for (const auto& [kind, count] : counts_) total += count;
    node.child("Count", total);
    node.child("ObjectType", "GlobalSettings").child("Count", std::int32_t{1});
    for (const auto& [kind, count] : counts_) node.child("ObjectType", kind.c_str()).child("Count", count);
    return node;
  }

  static FbxNode takes() {
    FbxNode node("Takes");
    node.child("Current", "");
    return node;
  }

  const Avatar& avatar_;
  Welding welding_;
  std::int64_t last_id_ = 1000000;
  std::int64_t geometry_ = next_id(), mesh_ = next_id();
  std::vector<std::int64_t> joint_ids_;
  FbxNode objects_{"Objects"}, connections_{"Connections"};
  std::map<std::string, std::int32_t> counts_;
};

}  // namespace

std::vector<std::byte> write_fbx(const Avatar& avatar) {
  return FbxWriter(avatar).write();
}

}  // namespace gyre
