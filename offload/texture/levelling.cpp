// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/levelling.h"

#include <Eigen/Sparse>
#include <algorithm>

namespace gyre {

namespace {

// Colour of a photograph near `end` along an edge: samples weighted down with their distance.
Eigen::Vector3f colour_near(const Photo& photo, const Eigen::Vector3d& end, const Eigen::Vector3d& other) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float total = 0;
  for (const float t : {0.0F, 0.25F, 0.5F, 0.75F}) {
    const auto pixel = photo.camera.project(photo.cam_from_world * Eigen::Vector3d(end + t * (other - end)));
    if (!pixel) continue;
    sum += (1.0F - t) * sample(photo, *pixel);
    total += 1.0F - t;
  }
  return total > 0 ? Eigen::Vector3f(sum / total) : sum;
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

void level_seams(std::span<const Eigen::Vector3d> vertices, std::span<const SharedEdge> edges,
                 std::span<const int> label, std::span<const Photo> photos, const LevelOptions& options,
                 VertexPatches& patches) {
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
      const Eigen::Vector3d& end = vertices[edge.vertex[k]];
      const Eigen::Vector3d& other = vertices[edge.vertex[1 - k]];
      const Eigen::Vector3f step = colour_near(photos[a], end, other) - colour_near(photos[b], end, other);
      add(unknown(edge.vertex[k], a), unknown(edge.vertex[k], b), 1.0, step.cast<double>());
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
