// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template_parts.h"

#include "offload/body/atlas_space.h"

namespace gyre {
namespace {

// Connected components: one label a node, labels in order of first appearance.
std::vector<int> components(std::size_t nodes, const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<int> root(nodes);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int node) {
    while (root[node] != node) node = root[node] = root[root[node]];
    return node;
  };
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 1; k < 3; ++k) root[find(t[k])] = find(t[0]);
  std::vector<int> label(nodes);
  std::map<int, int> labels;
  for (std::size_t i = 0; i < nodes; ++i)
    label[i] = labels.try_emplace(find(static_cast<int>(i)), labels.size()).first->second;
  return label;
}

Eigen::AlignedBox2d uv_box(const TriangleMesh& mesh, const std::vector<int>& triangles) {
  Eigen::AlignedBox2d box;
  for (int t : triangles)
    for (int k = 0; k < 3; ++k) box.extend(mesh.uv[mesh.uv_triangles[t][k]]);
  return box;
}

class Assembler {
 public:
  explicit Assembler(const Sources& sources) : sources_(sources) {
    base_points_.resize(BaseRanges::count);
    for (int v = 0; v < BaseRanges::count; ++v) base_points_[v] = {{v, v, v}, {1, 0, 0}, Eigen::Vector3d::Zero()};
  }

  Result<AssembledParts> run() {
    add_body();
    if (const auto ok = add_eyes(); !ok) return tl::unexpected(ok.error());
    if (const auto ok = add_teeth(); !ok) return tl::unexpected(ok.error());
    const auto in_range = [&](int first, int last) {
      std::vector<int> triangles;
      for (std::size_t t = 0; t < sources_.base.triangles.size(); ++t)
        if ((sources_.base.triangles[t].array() >= first && sources_.base.triangles[t].array() < last).all())
          triangles.push_back(static_cast<int>(t));
      return triangles;
    };
    const auto tongue = in_range(BaseRanges::body, BaseRanges::tongue_end);
    const auto lashes = in_range(BaseRanges::left_lashes, BaseRanges::lashes_end);
    if (rims_.size() < 2) return fail("base mesh without lids");
    if (!place(sources_.base, tongue, 0.09) || !add("tongue", sources_.base, base_points_, tongue) ||
        !place(sources_.base, lashes, 0.06) || !add("lashes", sources_.base, trimmed_lashes(), lashes))
      return fail("no space left in the atlas");
    return std::move(out_);
  }

 private:
  void add_body() {
    std::vector<int> triangles;
    for (std::size_t t = 0; t < sources_.base.triangles.size(); ++t)
      if ((sources_.base.triangles[t].array() < BaseRanges::body).all()) triangles.push_back(static_cast<int>(t));
    add("body", sources_.base, base_points_, triangles);
    space_.cover(out_.mesh.uv, out_.mesh.uv_triangles);
    for (std::size_t v = 0; v < out_.binding.size(); ++v) {
      const int twin = sources_.mirror[v];
      out_.mirror[v] = twin < BaseRanges::body ? twin : -1;
    }
    mark_interior();
  }

  // The mouth's and the sockets' linings have charts of their own, which touch the head's chart; so does the trunk's.
  void mark_interior() {
    constexpr int crown = 881, navel = 4121;
    const std::vector<int> chart = components(out_.mesh.uv.size(), out_.mesh.uv_triangles);
    std::vector<std::set<int>> charts_at(out_.binding.size());
    for (std::size_t t = 0; t < out_.mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) charts_at[out_.mesh.triangles[t][k]].insert(chart[out_.mesh.uv_triangles[t][k]]);
    const int head = *charts_at[crown].begin(), trunk = *charts_at[navel].begin();
    std::set<int> linings;
    for (const auto& charts : charts_at)
      if (charts.size() > 1 && charts.count(head)) linings.insert(charts.begin(), charts.end());
    linings.erase(head);
    linings.erase(trunk);
    for (std::size_t v = 0; v < charts_at.size(); ++v)
      out_.interior[v] = charts_at[v].size() == 1 && linings.count(*charts_at[v].begin());
    for (std::size_t v = 0; v < charts_at.size(); ++v)
      if (charts_at[v].count(head) &&
          std::any_of(charts_at[v].begin(), charts_at[v].end(), [&](int c) { return linings.count(c) > 0; }))
        rims_.push_back(static_cast<int>(v));
  }

  // The eyes' meshes have a clear cornea around the eyeball; only the eyeball, which has the large chart, is kept.
  Result<void> add_eyes() {
    const TriangleMesh& mesh = sources_.eyes.mesh;
    const std::vector<int> label = components(mesh.vertices.size(), mesh.triangles);
    std::map<int, std::vector<int>> triangles_of;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      triangles_of[label[mesh.triangles[t][0]]].push_back(static_cast<int>(t));
    for (const bool left : {true, false}) {
      const std::vector<int>* eyeball = nullptr;
      double largest = 0;
      for (const auto& [name, triangles] : triangles_of) {
        const double area = uv_box(mesh, triangles).volume();
        if ((mesh.vertices[mesh.triangles[triangles[0]][0]].x() > 0) != left || area <= largest) continue;
        largest = area;
        eyeball = &triangles;
      }
      if (!eyeball) return fail("eye mesh without an eyeball", left ? "left" : "right");
      if (!place(mesh, *eyeball, 0.085) || !add(left ? "leftEye" : "rightEye", mesh, sources_.eyes.binding, *eyeball))
        return fail("no space left in the atlas");
    }
    return {};
  }

  // Upper and lower teeth are told apart by what they are bound to; the strips of gum between them are left out.
  Result<void> add_teeth() {
    const TriangleMesh& mesh = sources_.teeth.mesh;
    std::vector<int> upper, lower, both;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      int up = 0;
      for (int k = 0; k < 3; ++k) up += sources_.teeth.binding[mesh.triangles[t][k]].base[0] >= BaseRanges::upper_teeth;
      if (up == 3) upper.push_back(static_cast<int>(t));
      if (up == 0) lower.push_back(static_cast<int>(t));
      if (up == 3 || up == 0) both.push_back(static_cast<int>(t));
    }
    if (!place(mesh, both, 0.1) || !add("upperTeeth", mesh, sources_.teeth.binding, upper) ||
        !add("lowerTeeth", mesh, sources_.teeth.binding, lower))
      return fail("no space left in the atlas");
    return {};
  }

  // The source's lashes are cards for a picture with transparency. Opaque, they look like lashes only when they are
  // short: each point is drawn to the rim of its lid, between the rim's two nearest vertices.
  std::vector<BoundPoint> trimmed_lashes() const {
    constexpr double kept = 0.25;
    std::vector<BoundPoint> trimmed = base_points_;
    const auto& at = sources_.base.vertices;
    for (int v = BaseRanges::left_lashes; v < BaseRanges::lashes_end; ++v) {
      const auto nearer = [&](int a, int b) { return (at[a] - at[v]).squaredNorm() < (at[b] - at[v]).squaredNorm(); };
      std::vector<int> rim = rims_;
      std::partial_sort(rim.begin(), rim.begin() + 2, rim.end(), nearer);
      const double first = (at[rim[0]] - at[v]).norm(), second = (at[rim[1]] - at[v]).norm();
      const double share = first + second > 0 ? second / (first + second) : 0.5;
      trimmed[v] = {{v, rim[0], rim[1]}, {kept, (1 - kept) * share, (1 - kept) * (1 - share)}, Eigen::Vector3d::Zero()};
    }
    return trimmed;
  }

  // Takes space `width` wide for the charts of these triangles; the next add()s put them there.
  bool place(const TriangleMesh& mesh, const std::vector<int>& triangles, double width) {
    const Eigen::AlignedBox2d box = uv_box(mesh, triangles);
    if (box.isEmpty() || box.sizes().minCoeff() <= 0) return false;
    const double scale = width / box.sizes().x();
    const auto corner = space_.take(scale * box.sizes());
    if (!corner) return false;
    atlas_from_uv_ = Eigen::Translation2d(*corner) * Eigen::Scaling(scale) * Eigen::Translation2d(-box.min());
    return true;
  }

  bool add(const std::string& name, const TriangleMesh& mesh, const std::vector<BoundPoint>& binding,
           const std::vector<int>& triangles) {
    std::set<int> used, used_uv;
    for (int t : triangles)
      for (int k = 0; k < 3; ++k) {
        used.insert(mesh.triangles[t][k]);
        used_uv.insert(mesh.uv_triangles[t][k]);
      }
    const auto first = static_cast<int>(out_.binding.size()),
               first_triangle = static_cast<int>(out_.mesh.triangles.size());
    std::map<int, int> vertex, uv;
    for (int v : used) {
      vertex[v] = static_cast<int>(out_.binding.size());
      out_.binding.push_back(binding[v]);
    }
    for (int v : used_uv) {
      uv[v] = static_cast<int>(out_.mesh.uv.size());
      out_.mesh.uv.emplace_back(atlas_from_uv_ * mesh.uv[v]);
    }
    for (int t : triangles) {
      const Eigen::Vector3i &a = mesh.triangles[t], &b = mesh.uv_triangles[t];
      out_.mesh.triangles.emplace_back(vertex[a[0]], vertex[a[1]], vertex[a[2]]);
      out_.mesh.uv_triangles.emplace_back(uv[b[0]], uv[b[1]], uv[b[2]]);
    }
    out_.mirror.resize(out_.binding.size(), -1);
    out_.interior.resize(out_.binding.size(), false);
    out_.parts.push_back({name, first, static_cast<int>(out_.binding.size()) - first, first_triangle,
                          static_cast<int>(triangles.size())});
    return !triangles.empty();
  }

  const Sources& sources_;
  std::vector<BoundPoint> base_points_;
  AtlasSpace space_;
  Eigen::Affine2d atlas_from_uv_ = Eigen::Affine2d::Identity();
  std::vector<int> rims_;  // vertices around the openings of mouth and eyes
  AssembledParts out_;
};

}  // namespace

Result<AssembledParts> assemble_parts(const Sources& sources) {
  return Assembler(sources).run();
}

std::vector<Eigen::Vector3d> bound_positions(const std::vector<BoundPoint>& binding,
                                             const std::vector<Eigen::Vector3f>& base) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(binding.size());
  for (const BoundPoint& p : binding) {
    Eigen::Vector3d at = p.offset;
    for (int k = 0; k < 3; ++k)
      if (p.weight[k] != 0) at += p.weight[k] * base[p.base[k]].cast<double>();
    positions.push_back(at);
  }
  return positions;
}

Eigen::MatrixXd bound_offsets(const std::vector<BoundPoint>& binding, const Target& target) {
  std::vector<Eigen::Vector3d> base(BaseRanges::count, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < target.vertices.size(); ++i) base[target.vertices[i]] += target.offsets[i].cast<double>();
  Eigen::MatrixXd offsets = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(binding.size()), 3);
  for (std::size_t v = 0; v < binding.size(); ++v)
    for (int k = 0; k < 3; ++k)
      offsets.row(static_cast<Eigen::Index>(v)) += binding[v].weight[k] * base[binding[v].base[k]].transpose();
  return offsets;
}

}  // namespace gyre
