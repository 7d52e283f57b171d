// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/levelling.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <optional>

namespace gyre {

namespace {

// Colour of photograph a minus that of b near one end of an edge: samples weighted down with their distance. Nothing
// where one of the two does not see the edge.
std::optional<Eigen::Vector3f> step_near(const PhotographedSurface& surface, const SharedEdge& edge, int end, int a,
                                         int b) {
  const Eigen::Vector3d& from = surface.mesh.vertices[edge.vertex[end]];
  const Eigen::Vector3d& to = surface.mesh.vertices[edge.vertex[1 - end]];
  const Eigen::Vector3d normal = (surface.normals[edge.face[0]] + surface.normals[edge.face[1]]).normalized();
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float total = 0;
  for (const float t : {0.0F, 0.25F, 0.5F, 0.75F}) {
    const Eigen::Vector3d point = from + t * (to - from);
    const auto in_a = surface.look(a, point, normal);
    const auto in_b = surface.look(b, point, normal);
    if (in_a.quality == ViewQuality::none || in_b.quality == ViewQuality::none) continue;
    const Eigen::Vector3f difference =
        sample(surface.photos[a], in_a.sight.pixel) - sample(surface.photos[b], in_b.sight.pixel);
    sum += (1.0F - t) * difference;
    total += 1.0F - t;
  }
  if (total == 0) return std::nullopt;
  return Eigen::Vector3f(sum / total);
}

}  // namespace

VertexPatches patches_at_vertices(std::span<const Eigen::Vector3i> triangles, std::span<const int> label,
                                  std::size_t vertices) {
  VertexPatches patches(vertices);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (label[t] < 0) continue;
    for (int k = 0; k < 3; ++k) {
      auto& here = patches[triangles[t][k]];
      const auto found = std::find_if(here.begin(), here.end(), [&](const auto& p) { return p.photo == label[t]; });
      if (found != here.end()) {
        found->share += 1.0F;
      } else {
        here.push_back({label[t], 1.0F});
      }
    }
  }
  for (auto& here : patches) {
    float total = 0;
    for (const VertexPatch& p : here) total += p.share;
    for (VertexPatch& p : here) p.share /= total;
  }
  return patches;
}

void level_seams(const PhotographedSurface& surface, std::span<const SharedEdge> edges, std::span<const int> label,
                 const LevelOptions& options, VertexPatches& patches) {
  std::vector<int> first(patches.size() + 1, 0);  // of a vertex's unknowns
  for (std::size_t v = 0; v < patches.size(); ++v) first[v + 1] = first[v] + static_cast<int>(patches[v].size());
  const int unknowns = first.back();
  if (unknowns == 0) return;
  const auto unknown = [&](int v, int photo) {
    for (std::size_t k = 0; k < patches[v].size(); ++k) {
      if (patches[v][k].photo == photo) return first[v] + static_cast<int>(k);
    }
    return -1;
  };

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
  // weight * (x[i] - x[j] + step)^2
  const auto add = [&](int i, int j, double weight, const Eigen::Vector3d& step) {
    entries.insert(entries.end(), {{i, i, weight}, {j, j, weight}, {i, j, -weight}, {j, i, -weight}});
    right.row(i) -= weight * step.transpose();
    right.row(j) += weight * step.transpose();
  };
  for (int i = 0; i < unknowns; ++i) entries.emplace_back(i, i, options.anchor);
  for (const SharedEdge& edge : edges) {
    const int a = label[edge.face[0]];
    const int b = label[edge.face[1]];
    if (a < 0 || b < 0) continue;
    for (const int photo : {a, b}) {
      add(unknown(edge.vertex[0], photo), unknown(edge.vertex[1], photo), options.smoothness, Eigen::Vector3d::Zero());
      if (a == b) break;
    }
    if (a == b) continue;
    for (int k = 0; k < 2; ++k) {
      const auto step = step_near(surface, edge, k, a, b);
      if (step) add(unknown(edge.vertex[k], a), unknown(edge.vertex[k], b), 1.0, step->cast<double>());
    }
  }
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::MatrixX3d offsets = solver.solve(right);
  for (std::size_t v = 0; v < patches.size(); ++v) {
    for (std::size_t k = 0; k < patches[v].size(); ++k) {
      patches[v][k].offset = offsets.row(first[v] + static_cast<int>(k)).transpose().cast<float>();
    }
  }
}

}  // namespace gyre
