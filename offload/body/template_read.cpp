// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/sha256.h"
#include "offload/body/glb.h"
#include "offload/body/template.h"
#include "offload/body/template_file.h"
#include "offload/body/template_tools.h"

namespace gyre {
namespace {

using Json = nlohmann::json;

constexpr std::size_t most_vertices = 1 << 20, most_joints = 255;

// Entries a template cannot do without, and what they are for.
constexpr std::array<std::pair<const char*, const char*>, 5> needed_entries = {
    {{"version", "the version of the form, 2"},
     {"name", "the template's name"},
     {"joints", "name, parent, vertices and weights of every joint, in the skin's order"},
     {"components", "what people differ in: role and offsets of each component; may be empty"},
     {"landmarks", "vertices by landmark name; may be empty"}}};

// Reads the packed form back, checking every index.
class TemplateReader {
 public:
  explicit TemplateReader(const GlbReader& glb) : glb_(glb) {}

  Result<BodyTemplate> read() {
    try {
      const auto place = find_place();
      if (!place) return tl::unexpected(place.error());
      const auto& [mesh, primitive] = *place;
      for (const auto step : {&TemplateReader::surface, &TemplateReader::skin, &TemplateReader::joints,
                              &TemplateReader::tables, &TemplateReader::expressions, &TemplateReader::components})
        if (const auto ok = (this->*step)(mesh, primitive); !ok) return tl::unexpected(ok.error());
    } catch (const Json::exception& error) {
      return fail("template of an unknown form", glb_.where(), error.what());
    }
    return std::move(body_);
  }

 private:
  tl::unexpected<Error> damaged(const std::string& what) const {
    return fail("damaged template: " + what, glb_.where(), "build or fetch it again");
  }
  tl::unexpected<Error> lacks(const std::string& what, const std::string& meaning) const {
    return fail("template lacks " + what, glb_.where(), "it holds " + meaning);
  }
  bool is_vertex(std::uint64_t v) const { return v < body_.mesh.vertices.size(); }

  // The mesh and its primitive, once everything that is needed is there and the content has its checksum.
  Result<std::pair<Json, Json>> find_place() {
    const Json& json = glb_.json();
    const auto first = [](const Json& from, const char* list) {
      const Json all = from.is_object() ? from.value(list, Json()) : Json();
      return all.is_array() && !all.empty() && all[0].is_object() ? all[0] : Json();
    };
    const Json mesh = first(json, "meshes"), primitive = first(mesh, "primitives");
    if (!primitive.is_object()) return lacks("a mesh", "the surface, as one primitive");
    const Json attributes = primitive.value("attributes", Json::object());
    for (const char* name : {"POSITION", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0"})
      if (!attributes.contains(name)) return lacks("the attribute " + std::string(name), "one value a vertex");
    if (!primitive.contains("indices")) return lacks("indices", "the triangles' corners");
    const Json extras = mesh.value("extras", Json::object());
    extras_ = extras.is_object() ? extras.value("gyre_template", Json()) : Json();
    if (!extras_.is_object()) return lacks("meshes[0].extras.gyre_template", "what glTF has no words for");
    for (const auto& [name, meaning] : needed_entries)
      if (!extras_.contains(name)) return lacks("gyre_template." + std::string(name), meaning);
    if (extras_.at("version") != template_format_version)
      return fail("template of an unknown version", glb_.where(), "build it again with this Gyre");
    if (extras_.contains("checksum") &&
        extras_.at("checksum") != Json(template_content_checksum(glb_.binary(), extras_)))
      return damaged("its content does not have its checksum");
    return std::pair(mesh, primitive);
  }

  // Values of an accessor that may have one of two types.
  template <class Small, class Large>
  Result<std::vector<Large>> either(const Json& index, int width) const {
    if (auto large = glb_.accessor<Large>(index, width)) return large;
    const auto small = glb_.accessor<Small>(index, width);
    if (!small) return tl::unexpected(small.error());
    return std::vector<Large>(small->begin(), small->end());
  }

  Result<void> surface(const Json&, const Json& primitive) {
    const auto positions = glb_.accessor<float>(primitive.at("attributes").at("POSITION"), 3);
    const auto uv = glb_.accessor<float>(primitive.at("attributes").at("TEXCOORD_0"), 2);
    const auto triangles = either<std::uint16_t, std::uint32_t>(primitive.at("indices"), 1);
    const auto sources = extras_.contains("seam_vertices") ? glb_.view<std::uint32_t>(extras_.at("seam_vertices"))
                                                           : Result<std::vector<std::uint32_t>>();
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
    for (std::size_t c = 0; c < corners; ++c) body_.mesh.uv.emplace_back((*uv)[2 * c], (*uv)[2 * c + 1]);
    const auto position = [&](std::size_t c) {
      return Eigen::Vector3d((*positions)[3 * c], (*positions)[3 * c + 1], (*positions)[3 * c + 2]);
    };
    vertex_of_.resize(corners);
    if (extras_.contains("seam_vertices")) {
      const std::size_t vertices = corners - sources->size();
      if (!std::all_of(sources->begin(), sources->end(), [&](std::uint32_t v) { return v < vertices; }))
        return damaged("a seam vertex");
      for (std::size_t c = 0; c < corners; ++c)
        vertex_of_[c] = c < vertices ? static_cast<int>(c) : static_cast<int>((*sources)[c - vertices]);
      for (std::size_t c = 0; c < vertices; ++c) corner_of_.push_back(static_cast<int>(c));
    } else {
      std::map<std::array<float, 3>, int> vertex_at;
      for (std::size_t c = 0; c < corners; ++c) {
        const auto [at, is_new] =
            vertex_at.try_emplace({(*positions)[3 * c], (*positions)[3 * c + 1], (*positions)[3 * c + 2]},
                                  static_cast<int>(corner_of_.size()));
        if (is_new) corner_of_.push_back(static_cast<int>(c));
        vertex_of_[c] = at->second;
      }
    }
    for (int c : corner_of_) body_.mesh.vertices.push_back(position(static_cast<std::size_t>(c)));
    for (std::size_t t = 0; t < triangles->size(); t += 3) {
      Eigen::Vector3i at, of;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t corner = (*triangles)[t + static_cast<std::size_t>(k)];
        if (corner >= corners) return damaged("a triangle's corner");
        at[k] = static_cast<int>(corner);
        of[k] = vertex_of_[corner];
      }
      body_.mesh.uv_triangles.push_back(at);
      body_.mesh.triangles.push_back(of);
    }
    return {};
  }

  Result<void> skin(const Json&, const Json& primitive) {
    const auto joints = either<std::uint8_t, std::uint16_t>(primitive.at("attributes").at("JOINTS_0"), 4);
    const auto weights = glb_.accessor<float>(primitive.at("attributes").at("WEIGHTS_0"), 4);
    if (!joints) return tl::unexpected(joints.error());
    if (!weights) return tl::unexpected(weights.error());
    const std::size_t count = extras_.at("joints").size();
    if (joints->size() != weights->size() || joints->size() < 4 * vertex_of_.size() || count > most_joints)
      return damaged("sizes of the skin");
    for (int corner : corner_of_) {
      SkinWeights skin;
      for (std::size_t k = 0; k < 4; ++k) {
        skin.joint[k] = (*joints)[4 * static_cast<std::size_t>(corner) + k];
        skin.weight[k] = (*weights)[4 * static_cast<std::size_t>(corner) + k];
        if (static_cast<std::size_t>(skin.joint[k]) >= count || !(skin.weight[k] >= 0 && skin.weight[k] <= 1))
          return damaged("a skin weight");
      }
      body_.skin.push_back(skin);
    }
    return {};
  }

  Result<void> joints(const Json&, const Json&) {
    for (const Json& entry : extras_.at("joints")) {
      Joint joint{entry.at("name").get<std::string>(), entry.at("parent").get<int>(), {}, {}};
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
      if (entry.contains("axes")) {
        const auto axes = entry.at("axes").get<std::vector<double>>(),
                   least = entry.at("least").get<std::vector<double>>(),
                   most = entry.at("most").get<std::vector<double>>();
        if (axes.size() != 9 || least.size() != 3 || most.size() != 3) return damaged("range of joint " + joint.name);
        joint.range.axes = Eigen::Map<const Eigen::Matrix3d>(axes.data());
        joint.range.least = Eigen::Map<const Eigen::Vector3d>(least.data());
        joint.range.most = Eigen::Map<const Eigen::Vector3d>(most.data());
        if (!(joint.range.axes.transpose() * joint.range.axes).isIdentity(1e-6) ||
            !((joint.range.most - joint.range.least).array() >= 0).all())
          return damaged("range of joint " + joint.name);
      }
      body_.joints.push_back(std::move(joint));
    }
    if (body_.joints.empty()) return damaged("no joints");
    return {};
  }

  Result<void> tables(const Json&, const Json&) {
    body_.name = extras_.at("name").get<std::string>();
    body_.notices = extras_.value("notices", std::string());
    body_.built_in = extras_.value("built_in", false);
    const std::size_t count = body_.mesh.vertices.size();
    if (extras_.contains("regions")) {
      const auto regions = glb_.view<std::uint8_t>(extras_.at("regions"));
      if (!regions) return tl::unexpected(regions.error());
      if (regions->size() != count) return damaged("size of the regions");
      for (std::uint8_t region : *regions) {
        if (region >= region_names.size()) return damaged("a region");
        body_.regions.push_back(static_cast<BodyRegion>(region));
      }
    } else {
      for (const SkinWeights& skin : body_.skin) {
        const auto most = std::max_element(skin.weight.begin(), skin.weight.end()) - skin.weight.begin();
        body_.regions.push_back(region_of_bone(body_.joints[skin.joint[most]].name));
      }
    }
    if (extras_.contains("mirror")) {
      const auto mirror = glb_.view<std::uint32_t>(extras_.at("mirror"));
      if (!mirror) return tl::unexpected(mirror.error());
      if (mirror->size() != count) return damaged("size of the mirror pairs");
      for (std::uint32_t twin : *mirror) {
        const bool paired = twin != std::numeric_limits<std::uint32_t>::max();
        if (paired && !is_vertex(twin)) return damaged("a mirror pair");
        body_.mirror.push_back(paired ? static_cast<int>(twin) : -1);
      }
    } else {
      constexpr double same = 1e-3;  // metres
      body_.mirror = mirror_by_position(body_.mesh.vertices, same);
    }
    if (!extras_.contains("parts"))
      extras_["parts"] =
          Json::array({{{"name", "body"}, {"vertices", count}, {"triangles", body_.mesh.triangles.size()}}});
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

  // Offsets of a component that is packed in views of its own.
  Result<Morph> packed(const Json& entry) const {
    Morph morph{entry.at("name").get<std::string>(), {}, {}};
    std::vector<std::uint32_t> listed(body_.mesh.vertices.size());
    std::iota(listed.begin(), listed.end(), 0U);
    if (entry.contains("vertices")) {
      auto given = glb_.view<std::uint32_t>(entry.at("vertices"));
      if (!given) return tl::unexpected(given.error());
      listed = std::move(*given);
    }
    std::vector<float> steps;
    const int bits = entry.at("bits").get<int>();
    if (bits == 8) {
      const auto bytes = glb_.view<std::int8_t>(entry.at("view"));
      if (!bytes) return tl::unexpected(bytes.error());
      steps.assign(bytes->begin(), bytes->end());
    } else if (bits == 16) {
      const auto shorts = glb_.view<std::int16_t>(entry.at("view"));
      if (!shorts) return tl::unexpected(shorts.error());
      steps.assign(shorts->begin(), shorts->end());
    } else {
      return damaged("bits of component " + morph.name);
    }
    const float step = entry.at("step").get<float>();
    if (steps.size() < 3 * listed.size() || !std::isfinite(step)) return damaged("component " + morph.name);
    for (std::size_t i = 0; i < listed.size(); ++i) {
      if (!is_vertex(listed[i])) return damaged("a vertex of component " + morph.name);
      const Eigen::Vector3f offset = step * Eigen::Map<const Eigen::Vector3f>(&steps[3 * i]);
      if ((offset.array() == 0).all()) continue;
      morph.vertices.push_back(static_cast<int>(listed[i]));
      morph.offsets.push_back(offset);
    }
    return morph;
  }

  // Components that are morph targets leave the expressions.
  Result<void> components(const Json&, const Json&) {
    for (const Json& entry : extras_.at("components")) {
      const auto name = entry.at("name").get<std::string>();
      Morph morph;
      if (entry.contains("target")) {
        const auto target = entry.at("target").get<std::string>();
        const auto found = std::find_if(body_.expressions.begin(), body_.expressions.end(),
                                        [&](const Morph& m) { return m.name == target; });
        if (found == body_.expressions.end())
          return lacks("the morph target '" + target + "'", "the offsets of component '" + name + "'");
        morph = std::move(*found);
        morph.name = name;
        body_.expressions.erase(found);
      } else {
        if (!entry.contains("view")) return lacks("offsets of component '" + name + "'", "a 'target' or a 'view'");
        auto read = packed(entry);
        if (!read) return tl::unexpected(read.error());
        morph = std::move(*read);
      }
      const float deviation = entry.value("standard_deviation", 1.0F);
      if (!(deviation > 0)) return damaged("standard deviation of component " + name);
      for (Eigen::Vector3f& offset : morph.offsets) offset *= deviation;
      const Json role = entry.at("role");
      if (role != "body" && role != "head") return damaged("role of component " + name);
      (role == "body" ? body_.shapes : body_.head_shapes).push_back(std::move(morph));
    }
    const Json means = extras_.value("shape_means", Json::object());
    for (const auto& [sex, mean] : means.items()) {
      const auto values = mean.get<std::vector<double>>();
      if (values.size() > body_.shapes.size()) return damaged("mean of the " + sex + " people");
      body_.shape_means[sex] =
          Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
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
      std::vector<std::uint32_t> indices;
      std::vector<float> offsets;
      if (accessor.contains("sparse")) {
        const Json& sparse = accessor.at("sparse");
        const Json &index_view = sparse.at("indices").at("bufferView"), type = sparse.at("indices").at("componentType");
        if (type == static_cast<int>(gltf::u16)) {
          const auto shorts = glb_.view<std::uint16_t>(index_view);
          if (!shorts) return tl::unexpected(shorts.error());
          indices.assign(shorts->begin(), shorts->end());
        } else {
          auto longs = glb_.view<std::uint32_t>(index_view);
          if (!longs) return tl::unexpected(longs.error());
          indices = std::move(*longs);
        }
        auto values = glb_.view<float>(sparse.at("values").at("bufferView"));
        if (!values) return tl::unexpected(values.error());
        offsets = std::move(*values);
      } else if (accessor.contains("bufferView")) {
        auto values = glb_.accessor<float>(targets[k].at("POSITION"), 3);
        if (!values) return tl::unexpected(values.error());
        offsets = std::move(*values);
        indices.resize(vertex_of_.size());
        std::iota(indices.begin(), indices.end(), 0U);
      }
      if (offsets.size() < 3 * indices.size()) return damaged("expression " + morph.name);
      for (std::size_t i = 0; i < indices.size(); ++i) {
        const Eigen::Vector3f offset = Eigen::Map<const Eigen::Vector3f>(&offsets[3 * i]);
        if (indices[i] >= vertex_of_.size() || !offset.allFinite()) return damaged("expression " + morph.name);
        const int vertex = vertex_of_[indices[i]];
        // Copies at a seam move as the vertex that is listed itself.
        if (corner_of_[vertex] != static_cast<int>(indices[i]) || (offset.array() == 0).all()) continue;
        morph.vertices.push_back(vertex);
        morph.offsets.push_back(offset);
      }
      body_.expressions.push_back(std::move(morph));
    }
    return {};
  }

  const GlbReader& glb_;
  Json extras_;
  BodyTemplate body_;
  std::vector<int> vertex_of_;  // per vertex of the primitive: the template's
  std::vector<int> corner_of_;  // per vertex of the template: the first such vertex of the primitive
};

}  // namespace

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
