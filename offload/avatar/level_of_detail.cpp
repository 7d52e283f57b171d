// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/level_of_detail.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

// Quadric error times a weight of the vertex that would go.
template <class M>
class ModWeightedQuadricT : public OpenMesh::Decimater::ModQuadricT<M> {
 public:
  DECIMATING_MODULE(ModWeightedQuadricT, M, WeightedQuadric);

  explicit ModWeightedQuadricT(M& mesh) : OpenMesh::Decimater::ModQuadricT<M>(mesh) {}

  void set_weights(const std::vector<float>* weights) { weights_ = weights; }

  float collapse_priority(const CollapseInfo& collapse) override {
    const float error = OpenMesh::Decimater::ModQuadricT<M>::collapse_priority(collapse);
    return error < 0 ? error : error * (*weights_)[static_cast<std::size_t>(collapse.v0.idx())];
  }

 private:
  const std::vector<float>* weights_ = nullptr;
};

// How much dearer a vertex is for the expressions that move it.
std::vector<float> expression_weights(const Avatar& avatar) {
  constexpr float full_motion = 0.005F;  // metres
  constexpr float dearest = 50.0F;
  std::vector<float> weights(avatar.positions.size(), 1.0F);
  for (std::size_t v = 0; v < weights.size(); ++v) {
    float largest = 0;
    for (const AvatarMorph& morph : avatar.morphs) largest = std::max(largest, morph.positions[v].norm());
    weights[v] += dearest * std::min(1.0F, largest / full_motion);
  }
  return weights;
}

// The avatar with only these triangles and the vertices that they use, in their order.
Avatar with_triangles(const Avatar& avatar, const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<int> index(avatar.positions.size(), -1);
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) index[t[k]] = 0;
  Avatar kept;
  kept.joints = avatar.joints;
  kept.texture = avatar.texture;
  kept.texture_type = avatar.texture_type;
  kept.normal_map = avatar.normal_map;
  kept.facts = avatar.facts;
  for (const AvatarMorph& morph : avatar.morphs) kept.morphs.push_back({morph.name, {}, {}});
  for (std::size_t v = 0; v < index.size(); ++v) {
    if (index[v] < 0) continue;
    index[v] = static_cast<int>(kept.positions.size());
    kept.positions.push_back(avatar.positions[v]);
    kept.normals.push_back(avatar.normals[v]);
    kept.uv.push_back(avatar.uv[v]);
    if (!avatar.tangents.empty()) kept.tangents.push_back(avatar.tangents[v]);
    kept.skin.push_back(avatar.skin[v]);
    for (std::size_t m = 0; m < avatar.morphs.size(); ++m) {
      kept.morphs[m].positions.push_back(avatar.morphs[m].positions[v]);
      kept.morphs[m].normals.push_back(avatar.morphs[m].normals[v]);
    }
  }
  for (const Eigen::Vector3i& t : triangles) kept.triangles.emplace_back(index[t[0]], index[t[1]], index[t[2]]);
  return kept;
}

}  // namespace

Result<Avatar> reduced(const Avatar& avatar, double share) {
  if (!(share > 0 && share <= 1))
    return fail("a level of detail keeps between none and all of the triangles", std::to_string(share),
                "give a share above 0 and up to 1");
  Mesh mesh;
  mesh.request_vertex_status();
  mesh.request_edge_status();
  mesh.request_face_status();
  mesh.request_face_normals();
  for (const Eigen::Vector3f& p : avatar.positions) mesh.add_vertex(Mesh::Point(p.x(), p.y(), p.z()));
  std::vector<Eigen::Vector3i> triangles;  // those that stay in any case
  for (const Eigen::Vector3i& t : avatar.triangles) {
    const auto corner = [&](int k) { return mesh.vertex_handle(static_cast<unsigned>(t[k])); };
    if (mesh.add_face(corner(0), corner(1), corner(2)).is_valid()) continue;
    triangles.push_back(t);  // it would make the surface branch
    for (int k = 0; k < 3; ++k) mesh.status(corner(k)).set_locked(true);
  }
  for (const auto vertex : mesh.vertices())
    if (mesh.is_boundary(vertex)) mesh.status(vertex).set_locked(true);
  mesh.update_face_normals();

  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  typename ModWeightedQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<Mesh>::Handle flipping;
  decimater.add(quadric);
  decimater.add(flipping);
  const std::vector<float> weights = expression_weights(avatar);
  decimater.module(quadric).set_weights(&weights);
  decimater.initialize();
  const auto wanted = static_cast<std::size_t>(std::lround(share * static_cast<double>(avatar.triangles.size())));
  decimater.decimate_to_faces(0, wanted > triangles.size() ? wanted - triangles.size() : 0);

  for (const auto face : mesh.faces()) {
    Eigen::Vector3i t;
    int k = 0;
    for (const auto vertex : mesh.fv_range(face)) t[k++] = vertex.idx();
    triangles.push_back(t);
  }
  return with_triangles(avatar, triangles);
}

}  // namespace gyre
