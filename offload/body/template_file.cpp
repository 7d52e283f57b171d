// SPDX-License-Identifier: Apache-2.0
// The packed template: a plain GLB (mesh, skin, expressions as morph targets) that any viewer opens, whose mesh extras
// hold what glTF has no words for. The first vertices of its primitive are the template's, in order; copies of those on
// texture seams follow.
#include "common/bundle/sha256.h"
#include "offload/body/glb.h"
#include "offload/body/template.h"

#include <set>

namespace gyre {
namespace {

using Json = nlohmann::json;

constexpr int format_version = 1;
constexpr std::size_t most_vertices = 1 << 20, most_joints = 255;

constexpr std::array<const char*, 12> region_names = {"torso",     "head",      "face",       "left_arm",
                                                      "right_arm", "left_hand", "right_hand", "left_leg",
                                                      "right_leg", "left_foot", "right_foot", "inner"};

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
  std::vector<float> offsets, zero_and_offsets;
  for (const auto& [vertex, offset] : moved) {
    indices.push_back(vertex);
    append(offsets, offset);
  }
  zero_and_offsets = offsets;
  if (indices.size() < count) append(zero_and_offsets, Eigen::Vector3f::Zero().eval());
  accessor.update(box_of(zero_and_offsets));
  if (!indices.empty()) {
    const int index_view = glb.add_view(indices), offset_view = glb.add_view(offsets);
    accessor["sparse"] = {{"count", indices.size()},
                          {"indices", {{"bufferView", index_view}, {"componentType", static_cast<int>(gltf::u32)}}},
                          {"values", {{"bufferView", offset_view}}}};
  }
  glb.json["accessors"].push_back(std::move(accessor));
  return static_cast<int>(glb.json["accessors"].size()) - 1;
}

// Shape components move every vertex: 16-bit steps of the component's largest offset keep them within 0.01 mm.
Json pack_shape(GlbWriter& glb, const Morph& morph, std::size_t vertices) {
  float largest = 0;
  for (const auto& offset : morph.offsets) largest = std::max(largest, offset.cwiseAbs().maxCoeff());
  const float step = std::max(largest / 32767.0F, 1e-9F);
  std::vector<std::int16_t> packed(3 * vertices, 0);
  for (std::size_t i = 0; i < morph.vertices.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      packed[3 * static_cast<std::size_t>(morph.vertices[i]) + static_cast<std::size_t>(axis)] =
          static_cast<std::int16_t>(std::lround(morph.offsets[i][axis] / step));
  return {{"name", morph.name}, {"step", step}, {"view", glb.add_view(packed)}};
}

// Reads the packed form back, checking every index.
class TemplateReader {
 public:
  explicit TemplateReader(const GlbReader& glb) : glb_(glb) {}

  Result<BodyTemplate> read() {
    try {
      const Json& mesh = glb_.json().at("meshes").at(0);
      const Json& primitive = mesh.at("primitives").at(0);
      extras_ = mesh.at("extras").at("gyre_template");
      if (extras_.at("version") != format_version)
        return fail("template of an unknown version", glb_.where(), "build it again with this Gyre");
      for (const auto step : {&TemplateReader::surface, &TemplateReader::skin, &TemplateReader::joints,
                              &TemplateReader::tables, &TemplateReader::shapes, &TemplateReader::expressions})
        if (const auto ok = (this->*step)(mesh, primitive); !ok) return tl::unexpected(ok.error());
    } catch (const Json::exception& error) {
      return fail("not a Gyre template", glb_.where(), error.what());
    }
    return std::move(body_);
  }

 private:
  tl::unexpected<Error> damaged(const std::string& what) const {
    return fail("damaged template: " + what, glb_.where(), "build or fetch it again");
  }
  bool is_vertex(std::uint64_t v) const { return v < body_.mesh.vertices.size(); }

  Result<void> surface(const Json&, const Json& primitive) {
    const auto positions = glb_.accessor<float>(primitive.at("attributes").at("POSITION"), 3);
    const auto uv = glb_.accessor<float>(primitive.at("attributes").at("TEXCOORD_0"), 2);
    const auto triangles = glb_.accessor<std::uint32_t>(primitive.at("indices"), 1);
    const auto sources = glb_.view<std::uint32_t>(extras_.at("seam_vertices"));
    for (const Error* error : {positions ? nullptr : &positions.error(), uv ? nullptr : &uv.error(),
                               triangles ? nullptr : &triangles.error(), sources ? nullptr : &sources.error()})
      if (error) return tl::unexpected(*error);
    const std::size_t corners = positions->size() / 3;
    if (corners == 0 || corners > most_vertices || uv->size() != 2 * corners || sources->size() >= corners ||
        triangles->size() % 3 != 0)
      return damaged("sizes of the surface");
    if (!std::all_of(positions->begin(), positions->end(), [](float x) { return std::isfinite(x); }) ||
        !std::all_of(uv->begin(), uv->end(), [](float x) { return std::isfinite(x); }))
      return damaged("a coordinate is not a number");
    const std::size_t vertices = corners - sources->size();
    TriangleMesh& mesh = body_.mesh;
    for (std::size_t v = 0; v < vertices; ++v)
      mesh.vertices.emplace_back((*positions)[3 * v], (*positions)[3 * v + 1], (*positions)[3 * v + 2]);
    for (std::size_t c = 0; c < corners; ++c) mesh.uv.emplace_back((*uv)[2 * c], (*uv)[2 * c + 1]);
    if (!std::all_of(sources->begin(), sources->end(), [&](std::uint32_t v) { return is_vertex(v); }))
      return damaged("a seam vertex");
    for (std::size_t t = 0; t < triangles->size(); t += 3) {
      Eigen::Vector3i at, of;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t corner = (*triangles)[t + static_cast<std::size_t>(k)];
        if (corner >= corners) return damaged("a triangle's corner");
        at[k] = static_cast<int>(corner);
        of[k] = corner < vertices ? at[k] : static_cast<int>((*sources)[corner - vertices]);
      }
      mesh.uv_triangles.push_back(at);
      mesh.triangles.push_back(of);
    }
    return {};
  }

  Result<void> skin(const Json&, const Json& primitive) {
    const auto joints = glb_.accessor<std::uint8_t>(primitive.at("attributes").at("JOINTS_0"), 4);
    const auto weights = glb_.accessor<float>(primitive.at("attributes").at("WEIGHTS_0"), 4);
    if (!joints) return tl::unexpected(joints.error());
    if (!weights) return tl::unexpected(weights.error());
    const std::size_t count = extras_.at("joints").size();
    if (joints->size() != weights->size() || joints->size() < 4 * body_.mesh.vertices.size() || count > most_joints)
      return damaged("sizes of the skin");
    for (std::size_t v = 0; v < body_.mesh.vertices.size(); ++v) {
      SkinWeights skin;
      for (std::size_t k = 0; k < 4; ++k) {
        skin.joint[k] = (*joints)[4 * v + k];
        skin.weight[k] = (*weights)[4 * v + k];
        if (static_cast<std::size_t>(skin.joint[k]) >= count || !(skin.weight[k] >= 0 && skin.weight[k] <= 1))
          return damaged("a skin weight");
      }
      body_.skin.push_back(skin);
    }
    return {};
  }

  Result<void> joints(const Json&, const Json&) {
    for (const Json& entry : extras_.at("joints")) {
      Joint joint{entry.at("name").get<std::string>(), entry.at("parent").get<int>(), {}};
      const auto vertices = entry.at("vertices").get<std::vector<std::int64_t>>();
      const auto weights = entry.at("weights").get<std::vector<double>>();
      if (joint.parent < -1 || joint.parent >= static_cast<int>(body_.joints.size()) ||
          (joint.parent < 0) != body_.joints.empty())
        return damaged("parent of joint " + joint.name);
      if (vertices.empty() || vertices.size() != weights.size()) return damaged("regressor of joint " + joint.name);
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (vertices[i] < 0 || !is_vertex(static_cast<std::uint64_t>(vertices[i])))
          return damaged("regressor of joint " + joint.name);
        joint.regressor.emplace_back(static_cast<int>(vertices[i]), weights[i]);
      }
      body_.joints.push_back(std::move(joint));
    }
    if (body_.joints.empty()) return damaged("no joints");
    return {};
  }

  Result<void> tables(const Json&, const Json&) {
    body_.name = extras_.at("name").get<std::string>();
    body_.notices = extras_.at("notices").get<std::string>();
    body_.built_in = extras_.at("built_in").get<bool>();
    const auto regions = glb_.view<std::uint8_t>(extras_.at("regions"));
    const auto mirror = glb_.view<std::uint32_t>(extras_.at("mirror"));
    if (!regions) return tl::unexpected(regions.error());
    if (!mirror) return tl::unexpected(mirror.error());
    const std::size_t count = body_.mesh.vertices.size();
    if (regions->size() != count || mirror->size() != count) return damaged("sizes of the tables");
    for (std::size_t v = 0; v < count; ++v) {
      const bool paired = (*mirror)[v] != std::numeric_limits<std::uint32_t>::max();
      if ((*regions)[v] >= region_names.size() || (paired && !is_vertex((*mirror)[v])))
        return damaged("a table's entry");
      body_.regions.push_back(static_cast<BodyRegion>((*regions)[v]));
      body_.mirror.push_back(paired ? static_cast<int>((*mirror)[v]) : -1);
    }
    std::size_t next_vertex = 0, next_triangle = 0;
    for (const Json& entry : extras_.at("parts")) {
      TemplatePart part;
      part.name = entry.at("name").get<std::string>();
      const auto vertices = entry.at("vertices").get<std::uint64_t>(),
                 triangles = entry.at("triangles").get<std::uint64_t>();
      if (vertices > count - next_vertex || triangles > body_.mesh.triangles.size() - next_triangle)
        return damaged("part " + part.name);
      part.first_vertex = static_cast<int>(next_vertex);
      part.vertex_count = static_cast<int>(vertices);
      part.first_triangle = static_cast<int>(next_triangle);
      part.triangle_count = static_cast<int>(triangles);
      next_vertex += vertices;
      next_triangle += triangles;
      body_.parts.push_back(std::move(part));
    }
    if (body_.parts.empty() || body_.parts[0].name != "body" || next_vertex != count ||
        next_triangle != body_.mesh.triangles.size())
      return damaged("parts");
    for (const auto& [name, vertex] : extras_.at("landmarks").items()) {
      const auto v = vertex.get<std::int64_t>();
      if (v < 0 || !is_vertex(static_cast<std::uint64_t>(v))) return damaged("landmark " + name);
      body_.landmarks[name] = static_cast<int>(v);
    }
    return {};
  }

  Result<void> shapes(const Json&, const Json&) {
    for (const Json& entry : extras_.at("shapes")) {
      const auto packed = glb_.view<std::int16_t>(entry.at("view"));
      if (!packed) return tl::unexpected(packed.error());
      const float step = entry.at("step").get<float>();
      Morph morph{entry.at("name").get<std::string>(), {}, {}};
      if (packed->size() < 3 * body_.mesh.vertices.size() || !std::isfinite(step))
        return damaged("shape " + morph.name);
      for (std::size_t v = 0; v < body_.mesh.vertices.size(); ++v) {
        const Eigen::Vector3f offset(step * (*packed)[3 * v], step * (*packed)[3 * v + 1], step * (*packed)[3 * v + 2]);
        if ((offset.array() == 0).all()) continue;
        morph.vertices.push_back(static_cast<int>(v));
        morph.offsets.push_back(offset);
      }
      body_.shapes.push_back(std::move(morph));
    }
    return {};
  }

  Result<void> expressions(const Json& mesh, const Json& primitive) {
    if (!primitive.contains("targets")) return {};
    const Json& names = mesh.at("extras").at("targetNames");
    const Json& targets = primitive.at("targets");
    if (names.size() != targets.size()) return damaged("names of the expressions");
    for (std::size_t k = 0; k < targets.size(); ++k) {
      Morph morph{names[k].get<std::string>(), {}, {}};
      const Json& accessor = glb_.json().at("accessors").at(targets[k].at("POSITION").get<std::size_t>());
      if (accessor.contains("sparse")) {
        const Json& sparse = accessor.at("sparse");
        const auto indices = glb_.view<std::uint32_t>(sparse.at("indices").at("bufferView"));
        const auto offsets = glb_.view<float>(sparse.at("values").at("bufferView"));
        if (!indices) return tl::unexpected(indices.error());
        if (!offsets) return tl::unexpected(offsets.error());
        if (offsets->size() < 3 * indices->size()) return damaged("expression " + morph.name);
        for (std::size_t i = 0; i < indices->size(); ++i) {
          if (!is_vertex((*indices)[i])) continue;  // a seam copy of a vertex that is listed itself
          morph.vertices.push_back(static_cast<int>((*indices)[i]));
          morph.offsets.emplace_back((*offsets)[3 * i], (*offsets)[3 * i + 1], (*offsets)[3 * i + 2]);
          if (!morph.offsets.back().allFinite()) return damaged("expression " + morph.name);
        }
      }
      body_.expressions.push_back(std::move(morph));
    }
    return {};
  }

  const GlbReader& glb_;
  Json extras_;
  BodyTemplate body_;
};

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
  Json primitive = {{"attributes", attributes},
                    {"indices", glb.add_accessor(corners.triangles, "SCALAR", 1, gltf::element_array_buffer)}};
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
    regressors.push_back({{"name", joint.name}, {"parent", joint.parent}, {"vertices", of}, {"weights", by}});
  }
  nodes.push_back({{"name", body.name}, {"mesh", 0}, {"skin", 0}});

  Json parts = Json::array(), shapes = Json::array();
  for (const TemplatePart& part : body.parts)
    parts.push_back({{"name", part.name}, {"vertices", part.vertex_count}, {"triangles", part.triangle_count}});
  for (const Morph& morph : body.shapes) shapes.push_back(pack_shape(glb, morph, vertices));
  std::vector<std::uint8_t> regions;
  std::vector<std::uint32_t> mirror;
  for (BodyRegion region : body.regions) regions.push_back(static_cast<std::uint8_t>(region));
  for (int twin : body.mirror)
    mirror.push_back(twin < 0 ? std::numeric_limits<std::uint32_t>::max() : static_cast<std::uint32_t>(twin));
  const std::vector<std::uint32_t> seam_vertices(corners.vertex.begin() + static_cast<std::ptrdiff_t>(vertices),
                                                 corners.vertex.end());
  Json extras = {{"version", format_version}, {"name", body.name},           {"notices", body.notices},
                 {"built_in", body.built_in}, {"joints", regressors},        {"parts", parts},
                 {"shapes", shapes},          {"landmarks", body.landmarks}, {"region_names", region_names}};
  extras["regions"] = glb.add_view(regions);
  extras["mirror"] = glb.add_view(mirror);
  extras["seam_vertices"] = glb.add_view(seam_vertices);

  const int inverse_bind_accessor = glb.add_accessor(inverse_bind, "MAT4", 16);
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

Result<BodyTemplate> read_template(const std::filesystem::path& file) {
  const Result<GlbReader> glb = GlbReader::open(file);
  if (!glb) return tl::unexpected(glb.error());
  Result<BodyTemplate> body = TemplateReader(*glb).read();
  if (!body) return body;
  Result<std::string> checksum = sha256_of_file(file);
  if (!checksum) return tl::unexpected(checksum.error());
  body->checksum = std::move(*checksum);
  return body;
}

}  // namespace gyre
