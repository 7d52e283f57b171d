// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/fill.h"

#include <Eigen/Sparse>
#include <algorithm>

namespace gyre {

namespace {

// Mean colour of the seen texels around each vertex; weight 0 where there is none.
struct VertexColours {
  std::vector<Eigen::Vector3f> colour;
  std::vector<float> weight;
};

VertexColours seen_colours(const Atlas& atlas, std::span<const Eigen::Vector3i> triangles, std::size_t vertices,
                           const Canvas& canvas) {
  VertexColours seen{std::vector<Eigen::Vector3f>(vertices, Eigen::Vector3f::Zero()),
                     std::vector<float>(vertices, 0.0F)};
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const TexelOrigin origin = canvas.origin[i];
    if (origin != TexelOrigin::strict && origin != TexelOrigin::loose && origin != TexelOrigin::mirrored) continue;
    const Eigen::Vector3d weights = corner_weights(atlas, i);
    for (int k = 0; k < 3; ++k) {
      const auto w = static_cast<float>(std::clamp(weights[k], 0.0, 1.0));
      const int v = triangles[atlas.triangle[i]][k];
      seen.colour[v] += w * canvas.colour[i];
      seen.weight[v] += w;
    }
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (seen.weight[v] > 0) seen.colour[v] /= seen.weight[v];
  }
  return seen;
}

Eigen::Vector3f mean_colour(const VertexColours& seen) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  for (std::size_t v = 0; v < seen.colour.size(); ++v) {
    sum += seen.weight[v] * seen.colour[v].cast<double>();
    total += seen.weight[v];
  }
  return total > 0 ? Eigen::Vector3f((sum / total).cast<float>()) : Eigen::Vector3f::Constant(128.0F);
}

void solve_harmonic(std::span<const Eigen::Vector3i> triangles, std::span<const std::uint8_t> skip,
                    VertexColours& seen) {
  std::vector<int> unknown(seen.colour.size(), -1);
  int unknowns = 0;
  for (std::size_t v = 0; v < unknown.size(); ++v) {
    if (seen.weight[v] <= 0) unknown[v] = unknowns++;
  }
  if (unknowns == 0) return;
  constexpr double anchor = 1e-6;  // gives parts without any seen vertex the mean colour
  const Eigen::Vector3d mean = mean_colour(seen).cast<double>();
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d right = (anchor * mean.transpose()).replicate(unknowns, 1);
  for (int i = 0; i < unknowns; ++i) entries.emplace_back(i, i, anchor);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (skip[t]) continue;
    for (int k = 0; k < 3; ++k) {
      const int v = triangles[t][k];
      const int w = triangles[t][(k + 1) % 3];
      for (const auto& [from, to] : {std::pair(v, w), std::pair(w, v)}) {
        if (unknown[from] < 0) continue;
        entries.emplace_back(unknown[from], unknown[from], 1.0);
        if (unknown[to] >= 0) {
          entries.emplace_back(unknown[from], unknown[to], -1.0);
        } else {
          right.row(unknown[from]) += seen.colour[to].cast<double>().transpose();
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::MatrixX3d solution = solver.solve(right);
  for (std::size_t v = 0; v < unknown.size(); ++v) {
    if (unknown[v] >= 0) seen.colour[v] = solution.row(unknown[v]).transpose().cast<float>();
  }
}

// One level of the push-pull pyramid.
struct Level {
  int size = 0;
  std::vector<Eigen::Vector3f> colour;
  std::vector<float> weight;
};

Level half(const Level& fine) {
  Level coarse{(fine.size + 1) / 2, {}, {}};
  coarse.colour.assign(static_cast<std::size_t>(coarse.size) * coarse.size, Eigen::Vector3f::Zero());
  coarse.weight.assign(coarse.colour.size(), 0.0F);
  for (int y = 0; y < fine.size; ++y) {
    for (int x = 0; x < fine.size; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * fine.size + x;
      const std::size_t j = static_cast<std::size_t>(y / 2) * coarse.size + x / 2;
      coarse.colour[j] += fine.weight[i] * fine.colour[i];
      coarse.weight[j] += fine.weight[i];
    }
  }
  for (std::size_t j = 0; j < coarse.colour.size(); ++j) {
    if (coarse.weight[j] > 0) coarse.colour[j] /= coarse.weight[j];
    coarse.weight[j] = std::min(1.0F, coarse.weight[j]);
  }
  return coarse;
}

}  // namespace

void fill_surface(const Atlas& atlas, std::span<const Eigen::Vector3i> triangles, std::size_t vertices,
                  std::span<const std::uint8_t> skip, Canvas& canvas) {
  VertexColours colours = seen_colours(atlas, triangles, vertices, canvas);
  solve_harmonic(triangles, skip, colours);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int t = atlas.triangle[i];
    if (t < 0 || skip[t] || canvas.origin[i] != TexelOrigin::none) continue;
    const Eigen::Vector3d weights = corner_weights(atlas, i).cwiseMax(0.0).cwiseMin(1.0);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int k = 0; k < 3; ++k) {
      sum += static_cast<float>(weights[k] / weights.sum()) * colours.colour[triangles[t][k]];
    }
    canvas.colour[i] = sum;
    canvas.origin[i] = TexelOrigin::filled;
  }
}

void fill_background(int size, Canvas& canvas) {
  std::vector<Level> pyramid(1);
  pyramid[0].size = size;
  pyramid[0].colour = canvas.colour;
  pyramid[0].weight.resize(canvas.colour.size());
  std::transform(canvas.origin.begin(), canvas.origin.end(), pyramid[0].weight.begin(),
                 [](TexelOrigin o) { return o == TexelOrigin::none ? 0.0F : 1.0F; });
  while (pyramid.back().size > 1) pyramid.push_back(half(pyramid.back()));
  for (std::size_t k = pyramid.size() - 1; k-- > 0;) {
    Level& fine = pyramid[k];
    const Level& coarse = pyramid[k + 1];
    for (int y = 0; y < fine.size; ++y) {
      for (int x = 0; x < fine.size; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * fine.size + x;
        if (fine.weight[i] > 0) continue;
        fine.colour[i] = coarse.colour[static_cast<std::size_t>(y / 2) * coarse.size + x / 2];
        fine.weight[i] = 1.0F;
      }
    }
  }
  canvas.colour = std::move(pyramid[0].colour);
}

}  // namespace gyre
