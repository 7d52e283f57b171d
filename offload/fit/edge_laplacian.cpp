// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/edge_laplacian.h"

#include "common/parallel/parallel.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

namespace gyre {

namespace {

constexpr double holding = 1e-10;  // keeps vertices that neither data nor neighbours hold where they are

struct Edge {
  std::array<int, 4> vertices{};  // ends p1 and p3, and the corners p2 and p4 across; -1: no second triangle
  Eigen::Vector4d operator_row;   // of D_e on p1 p2 p3 p4; zero without a second triangle
  Eigen::Vector3d reference;      // D_e xbar
  double area = 0.0;
  double stiffness = 1.0;
  double membrane = 0.0;  // squared: metres of EdgeLaplacian's over the edge's length in the reference
};

// He and Schaefer 2013, eq. 4. p1 p3 is the edge.
Eigen::Vector4d edge_operator(const Eigen::Vector3d& p1, const Eigen::Vector3d& p2, const Eigen::Vector3d& p3,
                              const Eigen::Vector3d& p4) {
  const double area_123 = 0.5 * (p2 - p1).cross(p3 - p1).norm(), area_134 = 0.5 * (p3 - p1).cross(p4 - p1).norm();
  const double area = area_123 + area_134, squared_length = (p3 - p1).squaredNorm();
  if (!(area > 0) || !(squared_length > 0)) return Eigen::Vector4d::Zero();
  const double across = squared_length * area;
  return {(area_123 * (p4 - p3).dot(p3 - p1) + area_134 * (p1 - p3).dot(p3 - p2)) / across, area_134 / area,
          (area_123 * (p3 - p1).dot(p1 - p4) + area_134 * (p2 - p1).dot(p1 - p3)) / across, area_123 / area};
}

std::vector<Edge> make_edges(const std::vector<Eigen::Vector3d>& x, std::span<const Eigen::Vector3i> triangles) {
  std::map<std::pair<int, int>, Edge> by_ends;
  for (const Eigen::Vector3i& t : triangles) {
    const double third = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm() / 6.0;
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3], across = t[(k + 2) % 3];
      const auto [found, fresh] = by_ends.try_emplace(std::minmax(a, b));
      Edge& edge = found->second;
      if (fresh) {
        edge.vertices = {a, across, b, -1};
      } else if (edge.vertices[3] < 0) {
        edge.vertices[3] = across;
      }
      edge.area += third;
    }
  }
  std::vector<Edge> edges;
  edges.reserve(by_ends.size());
  for (auto& [ends, edge] : by_ends) {
    const auto& v = edge.vertices;
    edge.operator_row.setZero();
    edge.reference.setZero();
    if (v[3] >= 0) {
      edge.operator_row = edge_operator(x[v[0]], x[v[1]], x[v[2]], x[v[3]]);
      for (int k = 0; k < 4; ++k) edge.reference += edge.operator_row[k] * x[v[k]];
    }
    edges.push_back(edge);
  }
  return edges;
}

// The rotation closest to a 3 x 3 matrix.
Eigen::Matrix3d closest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

}  // namespace

struct EdgeLaplacian::System {
  using Matrix = Eigen::SparseMatrix<double>;

  std::vector<Eigen::Vector3d> reference;
  std::vector<Edge> edges;
  std::vector<Eigen::Matrix3d> rotations;      // per edge
  std::vector<std::vector<int>> vertex_edges;  // edges that end at the vertex
  double total_area = 0.0;
  Matrix regulariser;           // sum A_e (D_e^T D_e + membrane), lower triangle, over the total area
  std::vector<double> weights;  // of the last factorisation, as is the stiffness
  double stiffness = 0.0;
  Eigen::SimplicialLDLT<Matrix, Eigen::Lower> solver;
};

EdgeLaplacian::EdgeLaplacian(std::vector<Eigen::Vector3d> reference, std::span<const Eigen::Vector3i> triangles,
                             double membrane, std::span<const double> vertex_stiffness)
    : system_(std::make_unique<System>()) {
  System& s = *system_;
  assert(vertex_stiffness.empty() || vertex_stiffness.size() == reference.size());
  s.edges = make_edges(reference, triangles);
  for (Edge& edge : s.edges) {
    const int a = edge.vertices[0], b = edge.vertices[2];
    if (!vertex_stiffness.empty()) edge.stiffness = 0.5 * (vertex_stiffness[a] + vertex_stiffness[b]);
    const double squared_length = (reference[a] - reference[b]).squaredNorm();
    if (squared_length > 0) edge.membrane = membrane * membrane / squared_length;
  }
  s.reference = std::move(reference);
  s.rotations.assign(s.edges.size(), Eigen::Matrix3d::Identity());
  s.vertex_edges.resize(s.reference.size());
  for (std::size_t e = 0; e < s.edges.size(); ++e) {
    s.total_area += s.edges[e].area;
    s.vertex_edges[s.edges[e].vertices[0]].push_back(static_cast<int>(e));
    s.vertex_edges[s.edges[e].vertices[2]].push_back(static_cast<int>(e));
  }
  if (!(s.total_area > 0)) s.total_area = 1.0;
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, double value) {
    if (row >= column) entries.emplace_back(row, column, value);
  };
  for (const Edge& edge : s.edges) {
    const double weight = edge.stiffness * edge.area / s.total_area;
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 4; ++k)
        if (edge.vertices[i] >= 0 && edge.vertices[k] >= 0)
          add(edge.vertices[i], edge.vertices[k], weight * edge.operator_row[i] * edge.operator_row[k]);
    const int a = edge.vertices[0], b = edge.vertices[2];
    add(a, a, weight * edge.membrane);
    add(b, b, weight * edge.membrane);
    add(std::max(a, b), std::min(a, b), -weight * edge.membrane);
  }
  for (std::size_t v = 0; v < s.reference.size(); ++v) add(static_cast<int>(v), static_cast<int>(v), 0.0);
  const auto n = static_cast<Eigen::Index>(s.reference.size());
  s.regulariser.resize(n, n);
  s.regulariser.setFromTriplets(entries.begin(), entries.end());
  s.solver.analyzePattern(s.regulariser);
}

EdgeLaplacian::EdgeLaplacian(EdgeLaplacian&&) noexcept = default;
EdgeLaplacian& EdgeLaplacian::operator=(EdgeLaplacian&&) noexcept = default;
EdgeLaplacian::~EdgeLaplacian() = default;

void EdgeLaplacian::fit_rotations(std::span<const Eigen::Vector3d> x, int threads) {
  System& s = *system_;
  assert(x.size() == s.reference.size());
  std::vector<Eigen::Matrix3d> moments(x.size(), Eigen::Matrix3d::Zero());
  for (std::size_t v = 0; v < x.size(); ++v)
    for (const int e : s.vertex_edges[v]) {
      const auto& ends = s.edges[e].vertices;
      moments[v] += (x[ends[2]] - x[ends[0]]) * (s.reference[ends[2]] - s.reference[ends[0]]).transpose();
    }
  constexpr std::size_t block = 512;
  parallel_for((s.edges.size() + block - 1) / block, threads, [&](std::size_t b) {
    for (std::size_t e = b * block; e < std::min(s.edges.size(), (b + 1) * block); ++e)
      s.rotations[e] = closest_rotation(moments[s.edges[e].vertices[0]] + moments[s.edges[e].vertices[2]]);
  });
}

bool EdgeLaplacian::factorise(std::span<const double> weights, double stiffness) {
  System& s = *system_;
  assert(weights.size() == s.reference.size());
  s.weights.assign(weights.begin(), weights.end());
  s.stiffness = stiffness;
  System::Matrix matrix = stiffness * s.regulariser;
  for (std::size_t v = 0; v < weights.size(); ++v) {
    const auto at = static_cast<Eigen::Index>(v);
    matrix.coeffRef(at, at) += weights[v] + holding;
  }
  s.solver.factorize(matrix);
  return s.solver.info() == Eigen::Success;
}

std::vector<Eigen::Vector3d> EdgeLaplacian::solve(std::span<const Eigen::Vector3d> targets,
                                                  std::span<const Eigen::Vector3d> x) const {
  const System& s = *system_;
  assert(x.size() == s.reference.size() && targets.size() == s.reference.size());
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixX3d right(n, 3);
  for (Eigen::Index v = 0; v < n; ++v) {
    right.row(v) = holding * x[v].transpose();
    if (s.weights[v] > 0) right.row(v) += s.weights[v] * targets[v].transpose();
  }
  for (std::size_t e = 0; e < s.edges.size(); ++e) {
    const Edge& edge = s.edges[e];
    const double weight = s.stiffness * edge.stiffness * edge.area / s.total_area;
    const Eigen::RowVector3d bend = weight * (s.rotations[e] * edge.reference).transpose();
    for (int k = 0; k < 4; ++k)
      if (edge.vertices[k] >= 0) right.row(edge.vertices[k]) += edge.operator_row[k] * bend;
    const int a = edge.vertices[0], b = edge.vertices[2];
    const Eigen::RowVector3d side =
        weight * edge.membrane * (s.rotations[e] * (s.reference[a] - s.reference[b])).transpose();
    right.row(a) += side;
    right.row(b) -= side;
  }
  const Eigen::MatrixX3d solution = s.solver.solve(right);
  std::vector<Eigen::Vector3d> moved(x.size());
  for (Eigen::Index v = 0; v < n; ++v) moved[v] = solution.row(v).transpose();
  return moved;
}

double EdgeLaplacian::energy(std::span<const Eigen::Vector3d> x) const {
  const System& s = *system_;
  double sum = 0.0;
  for (std::size_t e = 0; e < s.edges.size(); ++e) {
    const Edge& edge = s.edges[e];
    Eigen::Vector3d bend = -(s.rotations[e] * edge.reference);
    for (int k = 0; k < 4; ++k)
      if (edge.vertices[k] >= 0) bend += edge.operator_row[k] * x[edge.vertices[k]];
    const int a = edge.vertices[0], b = edge.vertices[2];
    const Eigen::Vector3d side = x[a] - x[b] - s.rotations[e] * (s.reference[a] - s.reference[b]);
    sum += edge.stiffness * edge.area * (bend.squaredNorm() + edge.membrane * side.squaredNorm());
  }
  return sum / s.total_area;
}

}  // namespace gyre
