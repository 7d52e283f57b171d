// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/avatar.h"

#include "common/mesh/tangents.h"
#include "offload/body/expression_transfer.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// Vertex normals that are unit everywhere, as glTF demands.
std::vector<Eigen::Vector3d> unit_normals(const std::vector<Eigen::Vector3d>& vertices,
                                          const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<Eigen::Vector3d> normals = vertex_normals(vertices, triangles);
  for (Eigen::Vector3d& n : normals) {
    if (n.norm() < 0.5) n = Eigen::Vector3d::UnitZ();
  }
  return normals;
}

// Offset below which a displacement is rounding and not shape, metres or units of a normal.
Eigen::Vector3f cleaned(const Eigen::Vector3d& offset) {
  return offset.cwiseAbs().maxCoeff() < 1e-6 ? Eigen::Vector3f(Eigen::Vector3f::Zero())
                                             : Eigen::Vector3f(offset.cast<float>());
}

}  // namespace

SkinWeights tidy_weights(const SkinWeights& weights) {
  std::vector<std::pair<float, int>> merged;  // weight, joint
  for (int k = 0; k < 4; ++k) {
    if (weights.weight[k] <= 0) continue;
    const auto found =
        std::find_if(merged.begin(), merged.end(), [&](const auto& m) { return m.second == weights.joint[k]; });
    if (found != merged.end()) {
      found->first += weights.weight[k];
    } else {
      merged.emplace_back(weights.weight[k], weights.joint[k]);
    }
  }
  std::stable_sort(merged.begin(), merged.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  double total = 0;
  for (const auto& m : merged) total += m.first;
  SkinWeights tidy;
  double kept = 0;
  std::size_t count = 0;
  for (; count < merged.size() && merged[count].first > 1e-4 * total; ++count) kept += merged[count].first;
  for (std::size_t k = 0; k < count; ++k) {
    tidy.joint[k] = merged[k].second;
    tidy.weight[k] = static_cast<float>(merged[k].first / kept);
  }
  if (count == 0) tidy.weight[0] = 1.0F;
  return tidy;
}

void add_normal_map(Avatar& avatar, std::vector<std::byte> png) {
  TriangleMesh mesh;
  for (const Eigen::Vector3f& p : avatar.positions) mesh.vertices.emplace_back(p.cast<double>());
  for (const Eigen::Vector2f& uv : avatar.uv) mesh.uv.emplace_back(uv.cast<double>());
  mesh.triangles = avatar.triangles;
  mesh.uv_triangles = avatar.triangles;
  std::vector<Eigen::Vector3d> normals;
  for (const Eigen::Vector3f& n : avatar.normals) normals.emplace_back(n.cast<double>());
  const auto tangents = corner_tangents(mesh, normals);
  avatar.tangents.assign(avatar.positions.size(), Eigen::Vector4f::UnitX() + Eigen::Vector4f::UnitW());
  for (std::size_t t = 0; t < tangents.size(); ++t)
    for (int k = 0; k < 3; ++k) avatar.tangents[avatar.triangles[t][k]] = tangents[t][static_cast<std::size_t>(k)];
  avatar.normal_map = std::move(png);
}

Result<Avatar> assemble_avatar(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                               const std::vector<Eigen::Vector3d>& rest_joints) {
  const TriangleMesh& mesh = body.mesh;
  if (rest_vertices.size() != mesh.vertices.size() || rest_joints.size() != body.joints.size()) {
    return fail("the fitted shape does not belong to this template", body.name, "run the fit stage again");
  }
  constexpr std::size_t most_joints = 127;  // some importers read joints as signed bytes
  if (body.joints.size() > most_joints) {
    return fail("the template has more joints than importers take", std::to_string(body.joints.size()),
                "use a template with at most " + std::to_string(most_joints));
  }
  if (mesh.uv_triangles.size() != mesh.triangles.size() || body.skin.size() != mesh.vertices.size()) {
    return fail("the template lacks texture coordinates or skin weights", body.name, "build the template again");
  }

  // One output vertex for every pair of surface vertex and texture coordinate, in their order.
  using Key = std::pair<int, int>;
  std::vector<Key> keys;
  keys.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) keys.emplace_back(mesh.triangles[t][k], mesh.uv_triangles[t][k]);
  }
  std::vector<Key> unique = keys;
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  const auto index_of = [&](const Key& key) {
    return static_cast<int>(std::lower_bound(unique.begin(), unique.end(), key) - unique.begin());
  };

  Avatar avatar;
  const std::vector<Eigen::Vector3d> normals = unit_normals(rest_vertices, mesh.triangles);
  for (const auto& [vertex, coordinate] : unique) {
    avatar.positions.emplace_back(rest_vertices[vertex].cast<float>());
    avatar.normals.emplace_back(normals[vertex].cast<float>().normalized());
    avatar.uv.emplace_back(mesh.uv[coordinate].cast<float>());
    avatar.skin.push_back(tidy_weights(body.skin[vertex]));
  }
  for (std::size_t i = 0; i < keys.size(); i += 3) {
    avatar.triangles.emplace_back(index_of(keys[i]), index_of(keys[i + 1]), index_of(keys[i + 2]));
  }
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    avatar.joints.push_back({body.joints[j].name, body.joints[j].parent, rest_joints[j]});
  }

  for (const Morph& expression : transfer_expressions(body, rest_vertices)) {
    std::vector<Eigen::Vector3d> moved = rest_vertices;
    add_morph(moved, expression, 1.0);
    const std::vector<Eigen::Vector3d> moved_normals = unit_normals(moved, mesh.triangles);
    AvatarMorph morph{expression.name, {}, {}};
    for (const auto& [vertex, coordinate] : unique) {
      morph.positions.push_back(cleaned(moved[vertex] - rest_vertices[vertex]));
      morph.normals.push_back(cleaned(moved_normals[vertex] - normals[vertex]));
    }
    avatar.morphs.push_back(std::move(morph));
  }
  return avatar;
}

}  // namespace gyre
