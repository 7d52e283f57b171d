// SPDX-License-Identifier: Apache-2.0
#include "offload/body/glb.h"
#include "offload/body/template.h"
#include "offload/body/template_file.h"

namespace gyre {
namespace {

using Json = nlohmann::json;

constexpr std::size_t largest_short = 65535;  // glTF keeps the last 16-bit index to itself
constexpr float tolerated = 1e-5F;            // metres that packing may change one standard deviation by

// The primitive's vertices: pairs of a template vertex and a texture coordinate.
struct Corners {
  std::vector<std::uint32_t> vertex;
  std::vector<Eigen::Vector2f> uv;
  std::vector<std::uint32_t> triangles;
};

Corners split_at_seams(const BodyTemplate& body) {
  const std::size_t count = body.mesh.vertices.size();
  Corners corners;
  corners.vertex.resize(count);
  std::iota(corners.vertex.begin(), corners.vertex.end(), 0U);
  corners.uv.assign(count, Eigen::Vector2f::Zero());
  std::vector<int> first_uv(count, -1);
  std::map<std::pair<int, int>, std::uint32_t> copies;
  for (std::size_t t = 0; t < body.mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int v = body.mesh.triangles[t][k], uv = body.mesh.uv_triangles[t][k];
      if (first_uv[v] < 0) {
        first_uv[v] = uv;
        corners.uv[v] = body.mesh.uv[uv].cast<float>();
      }
      if (first_uv[v] == uv) {
        corners.triangles.push_back(static_cast<std::uint32_t>(v));
        continue;
      }
      const auto [copy, is_new] = copies.try_emplace({v, uv}, static_cast<std::uint32_t>(corners.vertex.size()));
      if (is_new) {
        corners.vertex.push_back(static_cast<std::uint32_t>(v));
        corners.uv.push_back(body.mesh.uv[uv].cast<float>());
      }
      corners.triangles.push_back(copy->second);
    }
  return corners;
}

template <class Vector>
void append(std::vector<float>& floats, const Vector& vector) {
  for (Eigen::Index i = 0; i < vector.size(); ++i) floats.push_back(static_cast<float>(vector[i]));
}

Json box_of(const std::vector<float>& xyz) {
  Json low = Json::array(), high = Json::array();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float least = std::numeric_limits<float>::infinity(), most = -least;
    for (std::size_t i = axis; i < xyz.size(); i += 3) {
      least = std::min(least, xyz[i]);
      most = std::max(most, xyz[i]);
    }
    low.push_back(least);
    high.push_back(most);
  }
  return {{"min", low}, {"max", high}};
}

// A morph target as a sparse accessor over zeros.
int add_morph_target(GlbWriter& glb, const Morph& morph, const std::vector<std::vector<std::uint32_t>>& copies_of,
                     std::size_t count) {
  std::map<std::uint32_t, Eigen::Vector3f> moved;
  for (std::size_t i = 0; i < morph.vertices.size(); ++i) {
    moved[static_cast<std::uint32_t>(morph.vertices[i])] = morph.offsets[i];
    for (std::uint32_t copy : copies_of[morph.vertices[i]]) moved[copy] = morph.offsets[i];
  }
  Json accessor = {{"componentType", static_cast<int>(gltf::f32)}, {"count", count}, {"type", "VEC3"}};
  std::vector<std::uint32_t> indices;
  std::vector<std::uint16_t> short_indices;
  std::vector<float> offsets, zero_and_offsets;
  for (const auto& [vertex, offset] : moved) {
    indices.push_back(vertex);
    short_indices.push_back(static_cast<std::uint16_t>(vertex));
    append(offsets, offset);
  }
  zero_and_offsets = offsets;
  if (indices.size() < count) append(zero_and_offsets, Eigen::Vector3f::Zero().eval());
  accessor.update(box_of(zero_and_offsets));
  if (!indices.empty()) {
    const bool is_short = count <= largest_short;
    const int index_view = is_short ? glb.add_view(short_indices) : glb.add_view(indices);
    const int offset_view = glb.add_view(offsets);
    accessor["sparse"] = {
        {"count", indices.size()},
        {"indices",
         {{"bufferView", index_view}, {"componentType", static_cast<int>(is_short ? gltf::u16 : gltf::u32)}}},
        {"values", {{"bufferView", offset_view}}}};
  }
  glb.json["accessors"].push_back(std::move(accessor));
  return static_cast<int>(glb.json["accessors"].size()) - 1;
}

// Offsets as integers of the listed vertices (all when empty): bytes where these are fine enough.
Json pack_component(GlbWriter& glb, const Morph& morph, const char* role, const std::vector<std::uint32_t>& listed,
                    int listed_view, std::size_t vertices) {
  float largest = 0;
  for (const auto& offset : morph.offsets) largest = std::max(largest, offset.cwiseAbs().maxCoeff());
  const bool as_bytes = largest / 127 / 2 < tolerated;
  const float step = std::max(largest / (as_bytes ? 127.0F : 32767.0F), 1e-9F);
  std::vector<std::int32_t> place(vertices, -1);
  for (std::size_t i = 0; i < listed.size(); ++i) place[listed[i]] = static_cast<std::int32_t>(i);
  if (listed.empty()) std::iota(place.begin(), place.end(), 0);
  std::vector<std::int16_t> steps(3 * (listed.empty() ? vertices : listed.size()), 0);
  for (std::size_t i = 0; i < morph.vertices.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      steps[3 * static_cast<std::size_t>(place[morph.vertices[i]]) + static_cast<std::size_t>(axis)] =
          static_cast<std::int16_t>(std::lround(morph.offsets[i][axis] / step));
  Json component = {{"name", morph.name}, {"role", role}, {"step", step}, {"bits", as_bytes ? 8 : 16}};
  if (as_bytes) {
    std::string bytes;
    for (std::int16_t s : steps) bytes += static_cast<char>(s);
    component["view"] = glb.add_bytes(bytes, gltf::none);
  } else {
    component["view"] = glb.add_view(steps);
  }
  if (listed_view >= 0) component["vertices"] = listed_view;
  return component;
}

// Components of one role; those that leave much of the mesh alone share a list of what any of them moves.
void pack_components(GlbWriter& glb, const std::vector<Morph>& morphs, const char* role, std::size_t vertices,
                     Json& components) {
  std::set<std::uint32_t> moved;
  for (const Morph& morph : morphs) moved.insert(morph.vertices.begin(), morph.vertices.end());
  constexpr double most = 0.9;
  std::vector<std::uint32_t> listed;
  int view = -1;
  if (!moved.empty() && static_cast<double>(moved.size()) < most * static_cast<double>(vertices)) {
    listed.assign(moved.begin(), moved.end());
    view = glb.add_view(listed);
  }
  for (const Morph& morph : morphs) components.push_back(pack_component(glb, morph, role, listed, view, vertices));
}

Json numbers(const double* first, std::size_t count) {
  return std::vector<double>(first, first + count);
}

// Indices of the triangles' corners, in 16 bits where these suffice.
int add_indices(GlbWriter& glb, const Corners& corners) {
  if (corners.vertex.size() > largest_short)
    return glb.add_accessor(corners.triangles, "SCALAR", 1, gltf::element_array_buffer);
  const std::vector<std::uint16_t> triangles(corners.triangles.begin(), corners.triangles.end());
  return glb.add_accessor(triangles, "SCALAR", 1, gltf::element_array_buffer);
}

}  // namespace

Result<void> write_template(const BodyTemplate& body, const std::filesystem::path& file) {
  const Corners corners = split_at_seams(body);
  const std::size_t vertices = body.mesh.vertices.size(), count = corners.vertex.size();
  std::vector<std::vector<std::uint32_t>> copies_of(vertices);
  for (std::size_t c = vertices; c < count; ++c) copies_of[corners.vertex[c]].push_back(static_cast<std::uint32_t>(c));

  GlbWriter glb;
  std::vector<float> positions, uv, weights;
  std::vector<std::uint8_t> joints;
  for (std::size_t c = 0; c < count; ++c) {
    append(positions, body.mesh.vertices[corners.vertex[c]]);
    append(uv, corners.uv[c]);
    const SkinWeights& skin = body.skin[corners.vertex[c]];
    for (std::size_t k = 0; k < 4; ++k) {
      weights.push_back(skin.weight[k]);
      joints.push_back(static_cast<std::uint8_t>(skin.joint[k]));
    }
  }
  Json attributes;
  attributes["POSITION"] = glb.add_accessor(positions, "VEC3", 3, gltf::array_buffer);
  glb.json["accessors"].back().update(box_of(positions));
  attributes["TEXCOORD_0"] = glb.add_accessor(uv, "VEC2", 2, gltf::array_buffer);
  attributes["JOINTS_0"] = glb.add_accessor(joints, "VEC4", 4, gltf::array_buffer);
  attributes["WEIGHTS_0"] = glb.add_accessor(weights, "VEC4", 4, gltf::array_buffer);
  Json primitive = {{"attributes", attributes}, {"indices", add_indices(glb, corners)}};
  Json target_names = Json::array();
  for (const Morph& morph : body.expressions) {
    primitive["targets"].push_back({{"POSITION", add_morph_target(glb, morph, copies_of, count)}});
    target_names.push_back(morph.name);
  }

  // Nodes: the joints in order, then the skinned mesh.
  const std::vector<Eigen::Vector3d> at = joint_positions(body, body.mesh.vertices);
  std::vector<float> inverse_bind;
  Json nodes = Json::array(), skin_joints = Json::array(), regressors = Json::array();
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    const Joint& joint = body.joints[j];
    const Eigen::Vector3d from_parent = joint.parent < 0 ? at[j] : Eigen::Vector3d(at[j] - at[joint.parent]);
    nodes.push_back({{"name", joint.name}, {"translation", {from_parent.x(), from_parent.y(), from_parent.z()}}});
    if (joint.parent >= 0) nodes[joint.parent]["children"].push_back(j);
    skin_joints.push_back(j);
    Eigen::Matrix4f inverse = Eigen::Matrix4f::Identity();
    inverse.col(3).head<3>() = -at[j].cast<float>();
    inverse_bind.insert(inverse_bind.end(), inverse.data(), inverse.data() + 16);
    Json of = Json::array(), by = Json::array();
    for (const auto& [vertex, weight] : joint.regressor) {
      of.push_back(vertex);
      by.push_back(weight);
    }
    regressors.push_back({{"name", joint.name},
                          {"parent", joint.parent},
                          {"vertices", of},
                          {"weights", by},
                          {"axes", numbers(joint.range.axes.data(), 9)},
                          {"least", numbers(joint.range.least.data(), 3)},
                          {"most", numbers(joint.range.most.data(), 3)}});
  }
  nodes.push_back({{"name", body.name}, {"mesh", 0}, {"skin", 0}});

  Json parts = Json::array(), components = Json::array(), means = Json::object();
  for (const TemplatePart& part : body.parts)
    parts.push_back({{"name", part.name}, {"vertices", part.vertex_count}, {"triangles", part.triangle_count}});
  pack_components(glb, body.shapes, "body", vertices, components);
  pack_components(glb, body.head_shapes, "head", vertices, components);
  for (const auto& [sex, mean] : body.shape_means)
    means[sex] = numbers(mean.data(), static_cast<std::size_t>(mean.size()));
  std::vector<std::uint8_t> regions;
  std::vector<std::uint32_t> mirror;
  for (BodyRegion region : body.regions) regions.push_back(static_cast<std::uint8_t>(region));
  for (int twin : body.mirror)
    mirror.push_back(twin < 0 ? std::numeric_limits<std::uint32_t>::max() : static_cast<std::uint32_t>(twin));
  const std::vector<std::uint32_t> seam_vertices(corners.vertex.begin() + static_cast<std::ptrdiff_t>(vertices),
                                                 corners.vertex.end());
  Json extras = {{"version", template_format_version}, {"name", body.name},    {"notices", body.notices},
                 {"built_in", body.built_in},          {"joints", regressors}, {"parts", parts},
                 {"components", components},           {"shape_means", means}, {"landmarks", body.landmarks},
                 {"region_names", region_names}};
  extras["regions"] = glb.add_view(regions);
  extras["mirror"] = glb.add_view(mirror);
  extras["seam_vertices"] = glb.add_view(seam_vertices);

  const int inverse_bind_accessor = glb.add_accessor(inverse_bind, "MAT4", 16);
  extras["checksum"] = template_content_checksum(glb.binary(), extras);
  glb.json["asset"]["copyright"] = body.notices;
  glb.json["meshes"] = Json::array({{{"name", body.name},
                                     {"primitives", Json::array({primitive})},
                                     {"extras", {{"targetNames", target_names}, {"gyre_template", extras}}}}});
  glb.json["skins"] =
      Json::array({{{"joints", skin_joints}, {"inverseBindMatrices", inverse_bind_accessor}, {"skeleton", 0}}});
  glb.json["nodes"] = nodes;
  glb.json["scenes"] = Json::array({{{"nodes", {0, nodes.size() - 1}}}});
  glb.json["scene"] = 0;
  return glb.write(file);
}

}  // namespace gyre
