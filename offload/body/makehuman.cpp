// SPDX-License-Identifier: Apache-2.0
#include "offload/body/makehuman.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/humanoid.h"
#include "offload/body/npz.h"

#include <nlohmann/json.hpp>

namespace gyre {
namespace {

constexpr double metres_per_unit = 0.1;

bool is_base_vertex(long vertex) {
  return vertex >= 0 && vertex < BaseRanges::count;
}

Result<TriangleMesh> read_mesh(const std::filesystem::path& file) {
  Result<TriangleMesh> mesh = read_obj(file);
  if (!mesh) return mesh;
  for (Eigen::Vector3d& v : mesh->vertices) v *= metres_per_unit;
  if (mesh->uv_triangles.size() != mesh->triangles.size())
    return fail("mesh without texture coordinates", file.string());
  return mesh;
}

// Targets of one archive whose name (without folders) `wanted` accepts.
template <class Wanted>
Result<void> read_targets(const std::filesystem::path& file, const Wanted& wanted, TargetSet& targets) {
  const Result<NpzArrays> archive = read_npz(file);
  if (!archive) return tl::unexpected(archive.error());
  const auto& arrays = archive->integers;
  for (const char* name : {"names", "start", "index", "delta_x", "delta_y", "delta_z"})
    if (!arrays.count(name)) return fail("archive without array '" + std::string(name) + "'", file.string());
  const auto& start = arrays.at("start");
  const auto& index = arrays.at("index");
  const auto& x = arrays.at("delta_x");
  const auto& y = arrays.at("delta_y");
  const auto& z = arrays.at("delta_z");
  std::string text;
  for (int c : arrays.at("names")) text += static_cast<char>(c);
  std::istringstream names(text);
  std::string name;
  for (std::size_t k = 0; std::getline(names, name); ++k) {
    if (k + 1 >= start.size() || start[k] < 0 || start[k] > start[k + 1] ||
        static_cast<std::size_t>(start[k + 1]) > std::min({index.size(), x.size(), y.size(), z.size()}))
      return fail("target outside its archive", file.string() + " " + name);
    const std::string short_name = name.substr(name.rfind('/') + 1);
    if (!wanted(name)) continue;
    constexpr float unit = 1e-4F;  // the archive counts tenths of millimetres
    Target target;
    for (int e = start[k]; e < start[k + 1]; ++e) {
      if (!is_base_vertex(index[e])) return fail("target moves a vertex that is not there", file.string() + " " + name);
      target.vertices.push_back(index[e]);
      target.offsets.emplace_back(
          unit * Eigen::Vector3f(static_cast<float>(x[e]), static_cast<float>(y[e]), static_cast<float>(z[e])));
    }
    targets[short_name] = std::move(target);
  }
  return {};
}

Result<nlohmann::json> read_json(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
  if (json.is_discarded()) return fail("not JSON", file.string());
  return json;
}

Result<void> read_rig(const std::filesystem::path& folder, Sources& sources) {
  const std::filesystem::path rig_file = folder / "default.mhskel", weight_file = folder / "default_weights.mhw";
  const Result<nlohmann::json> rig = read_json(rig_file);
  if (!rig) return tl::unexpected(rig.error());
  const Result<nlohmann::json> weights = read_json(weight_file);
  if (!weights) return tl::unexpected(weights.error());
  try {
    for (const auto& [name, bone] : rig->at("bones").items()) {
      SourceBone read;
      if (bone.at("parent").is_string()) read.parent = bone.at("parent").get<std::string>();
      read.head = rig->at("joints").at(bone.at("head").get<std::string>()).get<std::vector<int>>();
      if (read.head.empty() || !std::all_of(read.head.begin(), read.head.end(), is_base_vertex))
        return fail("joint of vertices that are not there", rig_file.string() + " " + name);
      sources.bones[name] = std::move(read);
    }
    for (const auto& [name, list] : weights->at("weights").items()) {
      auto& read = sources.weights[name];
      for (const auto& entry : list) {
        read.emplace_back(entry.at(0).get<int>(), entry.at(1).get<double>());
        if (!is_base_vertex(read.back().first) || !(read.back().second >= 0))
          return fail("bad weight", weight_file.string() + " " + name);
      }
    }
  } catch (const nlohmann::json::exception& error) {
    return fail("rig of an unknown form", rig_file.string(), error.what());
  }
  for (const auto& [name, bone] : sources.bones)
    if (!bone.parent.empty() && !sources.bones.count(bone.parent))
      return fail("bone with an unknown parent", rig_file.string() + " " + name);
  return {};
}

Result<std::vector<int>> read_mirror(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  std::vector<int> mirror(BaseRanges::count, -1);
  std::istringstream lines(*text);
  int from = 0, to = 0;
  std::string side;
  while (lines >> from >> to >> side) {
    if (!is_base_vertex(from) || !is_base_vertex(to)) return fail("bad mirror pair", file.string());
    mirror[from] = to;
  }
  return mirror;
}

// A .mhclo line is either one base vertex, or three with their weights and an offset. Offsets are along the axes and
// grow with a distance of the base mesh, e.g. `x_scale a b d`: by |a - b| / d.
Result<BoundMesh> read_bound_mesh(const std::filesystem::path& folder, const std::string& name,
                                  const TriangleMesh& base) {
  const std::filesystem::path file = folder / (name + ".mhclo");
  BoundMesh bound;
  Result<TriangleMesh> mesh = read_mesh(folder / (name + ".obj"));
  if (!mesh) return tl::unexpected(mesh.error());
  bound.mesh = std::move(*mesh);
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());

  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  std::istringstream lines(*text);
  std::string line;
  bool in_vertices = false;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    if (in_vertices) {
      BoundPoint p;
      if (!(words >> p.base[0])) break;
      if (words >> p.base[1] >> p.base[2] >> p.weight[0] >> p.weight[1] >> p.weight[2]) {
        words >> p.offset.x() >> p.offset.y() >> p.offset.z();
        if (!words) return fail("bad binding", file.string());
        p.offset = metres_per_unit * p.offset.cwiseProduct(scale);
      } else {
        p.base[1] = p.base[2] = p.base[0];
        p.weight = {1, 0, 0};
      }
      if (!std::all_of(p.base.begin(), p.base.end(), is_base_vertex)) return fail("bad binding", file.string());
      bound.binding.push_back(p);
      continue;
    }
    std::string key;
    words >> key;
    in_vertices = key == "verts";
    const int axis = key == "x_scale" ? 0 : key == "y_scale" ? 1 : key == "z_scale" ? 2 : -1;
    int a = 0, b = 0;
    double distance = 0;
    if (axis < 0) continue;
    if (!(words >> a >> b >> distance) || !is_base_vertex(a) || !is_base_vertex(b) || !(distance > 0))
      return fail("bad scale", file.string());
    scale[axis] = std::abs(base.vertices[a][axis] - base.vertices[b][axis]) / (metres_per_unit * distance);
  }
  if (bound.binding.size() != bound.mesh.vertices.size()) return fail("bindings do not match the mesh", file.string());
  return bound;
}

}  // namespace

Result<Sources> read_sources(const std::filesystem::path& folder) {
  Sources sources;
  Result<TriangleMesh> base = read_mesh(folder / "mesh" / "hm08_base.obj");
  if (!base) return tl::unexpected(base.error());
  sources.base = std::move(*base);
  if (sources.base.vertices.size() != BaseRanges::count)
    return fail("not the hm08 base mesh", (folder / "mesh" / "hm08_base.obj").string());
  if (const auto ok = read_rig(folder / "rig", sources); !ok) return tl::unexpected(ok.error());
  Result<std::vector<int>> mirror = read_mirror(folder / "meta" / "hm08.mirror");
  if (!mirror) return tl::unexpected(mirror.error());
  sources.mirror = std::move(*mirror);

  const auto adult = [](const std::string& name) { return name.find("-baby") == std::string::npos; };
  const auto breast = [](const std::string& name) { return name.starts_with("breast/female-"); };
  const auto all = [](const std::string&) { return true; };
  if (const auto ok = read_targets(folder / "targets_macrodetails.npz", adult, sources.targets); !ok)
    return tl::unexpected(ok.error());
  if (const auto ok = read_targets(folder / "targets_details.npz", breast, sources.targets); !ok)
    return tl::unexpected(ok.error());
  if (const auto ok = read_targets(folder / "targets_measure.npz", all, sources.targets); !ok)
    return tl::unexpected(ok.error());
  if (const auto ok = read_targets(folder / "targets_faceunits01.npz", all, sources.expressions); !ok)
    return tl::unexpected(ok.error());
  if (const auto ok = read_targets(folder / "targets_visemes02.npz", all, sources.expressions); !ok)
    return tl::unexpected(ok.error());
  for (const std::string_view name : arkit_expressions())
    if (!sources.expressions.count(std::string(name)))
      return fail("no face unit '" + std::string(name) + "'", (folder / "targets_faceunits01.npz").string());
  for (const std::string_view name : oculus_visemes())
    if (!sources.expressions.count(std::string(name)))
      return fail("no viseme '" + std::string(name) + "'", (folder / "targets_visemes02.npz").string());

  Result<BoundMesh> eyes = read_bound_mesh(folder / "mesh", "high-poly", sources.base);
  if (!eyes) return tl::unexpected(eyes.error());
  sources.eyes = std::move(*eyes);
  Result<BoundMesh> teeth = read_bound_mesh(folder / "mesh", "teeth_base", sources.base);
  if (!teeth) return tl::unexpected(teeth.error());
  sources.teeth = std::move(*teeth);

  const std::filesystem::path licence_file = folder / "licences" / "ICT-FaceKit_LICENSE";
  const Result<std::string> licence = read_file(licence_file);
  if (!licence) return tl::unexpected(licence.error());
  sources.notices =
      "Mesh, targets, rig, eyes, teeth, tongue and lashes: MakeHuman community (makehuman, mpfb2 and "
      "makehuman-assets), CC0 1.0. Face units and visemes: Mika Suominen (extra-targets) and the MakeHuman community, "
      "CC0 1.0. Body statistics: ANSUR II, US Army 2012, public release. Head components: derived from ICT-FaceKit, "
      "under "
      "this licence:\n\n" +
      *licence;
  return sources;
}

}  // namespace gyre
