// SPDX-License-Identifier: Apache-2.0
#include "offload/body/cage.h"

#include <cassert>
#include <map>
#include <utility>

namespace gyre {
namespace {

struct Edge {
  int point = 0;  // row of the edge point
  std::vector<int> faces;
};

std::pair<int, int> edge_key(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

SubdividedCage subdivide(int vertex_count, const std::vector<CageFace>& faces) {
  std::map<std::pair<int, int>, Edge> edges;
  std::vector<std::vector<int>> faces_of(vertex_count);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto& corners = faces[f].corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      edges[edge_key(corners[i], corners[(i + 1) % corners.size()])].faces.push_back(static_cast<int>(f));
      faces_of[corners[i]].push_back(static_cast<int>(f));
    }
  }
  int next = vertex_count;
  std::vector<std::vector<std::pair<int, int>>> edges_of(vertex_count);
  for (auto& [ends, edge] : edges) {
    assert(edge.faces.size() == 2);
    edge.point = next++;
    edges_of[ends.first].push_back(ends);
    edges_of[ends.second].push_back(ends);
  }
  const int first_face_point = next;
  const int rows = first_face_point + static_cast<int>(faces.size());

  std::vector<Eigen::Triplet<double>> entries;
  const auto add_face_point = [&](int row, int face, double weight) {
    const auto& corners = faces[face].corners;
    for (int corner : corners) entries.emplace_back(row, corner, weight / static_cast<double>(corners.size()));
  };
  for (int v = 0; v < vertex_count; ++v) {
    const auto n = static_cast<double>(faces_of[v].size());
    entries.emplace_back(v, v, (n - 3) / n);
    for (int face : faces_of[v]) add_face_point(v, face, 1 / (n * n));
    for (const auto& [a, b] : edges_of[v]) {
      entries.emplace_back(v, a, 1 / (n * n));
      entries.emplace_back(v, b, 1 / (n * n));
    }
  }
  for (const auto& [ends, edge] : edges) {
    entries.emplace_back(edge.point, ends.first, 0.25);
    entries.emplace_back(edge.point, ends.second, 0.25);
    for (int face : edge.faces) add_face_point(edge.point, face, 0.25);
  }
  for (std::size_t f = 0; f < faces.size(); ++f)
    add_face_point(first_face_point + static_cast<int>(f), static_cast<int>(f), 1);

  SubdividedCage result;
  result.weights.resize(rows, vertex_count);
  result.weights.setFromTriplets(entries.begin(), entries.end());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const CageFace& face = faces[f];
    const std::size_t n = face.corners.size();
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& uv : face.uv) middle += uv / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t after = (i + 1) % n;
      const std::size_t before = (i + n - 1) % n;
      CageFace quad;
      quad.corners = {face.corners[i], edges[edge_key(face.corners[i], face.corners[after])].point,
                      first_face_point + static_cast<int>(f),
                      edges[edge_key(face.corners[before], face.corners[i])].point};
      quad.uv = {face.uv[i], 0.5 * (face.uv[i] + face.uv[after]), middle, 0.5 * (face.uv[before] + face.uv[i])};
      result.faces.push_back(std::move(quad));
    }
  }
  return result;
}

SubdividedCage subdivide(int vertex_count, const std::vector<CageFace>& faces, int steps) {
  SubdividedCage result = subdivide(vertex_count, faces);
  for (int step = 1; step < steps; ++step) {
    SubdividedCage finer = subdivide(static_cast<int>(result.weights.rows()), result.faces);
    finer.weights = Eigen::SparseMatrix<double, Eigen::RowMajor>(finer.weights * result.weights);
    result = std::move(finer);
  }
  return result;
}

Eigen::MatrixXd cage_through(const Eigen::MatrixXd& wanted, const SubdividedCage& subdivision) {
  Eigen::MatrixXd cage = wanted;
  constexpr int iterations = 12;
  constexpr double damping = 0.8;
  for (int i = 0; i < iterations; ++i) {
    const Eigen::MatrixXd refined = subdivision.weights * cage;
    cage += damping * (wanted - refined.topRows(wanted.rows()));
  }
  return cage;
}

}  // namespace gyre
