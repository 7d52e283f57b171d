// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/texel_solver.h"

#include "common/parallel/parallel.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace gyre {

namespace {

using Sums = Eigen::Array3d;  // one a channel

constexpr int most_rounds = 400;
constexpr int triangles_a_chunk = 128;

// Hat functions of the corners of a texel's triangle; on the rim, those of the nearest point of the triangle.
Eigen::Vector3f hats(const Atlas& atlas, std::int32_t texel) {
  const Eigen::Vector2f& w = atlas.weights[texel];
  const Eigen::Vector3f inside = Eigen::Vector3f(1 - w.x() - w.y(), w.x(), w.y()).cwiseMax(0.0F);
  return inside / inside.sum();
}

class Solver {
 public:
  Solver(const TriangleMesh& mesh, const Atlas& atlas, const TexelGraph& graph, std::span<const float> diagonal,
         int threads)
      : mesh_(mesh), atlas_(atlas), graph_(graph), threads_(threads), centre_(diagonal.begin(), diagonal.end()) {
    for (std::size_t n = 0; n < centre_.size(); ++n) {
      for (const std::int32_t m : graph_.neighbour[n]) centre_[n] += m >= 0 ? 1.0F : 0.0F;
    }
    for (const auto& [a, b] : graph_.links) {
      centre_[a] += 1.0F;
      centre_[b] += 1.0F;
    }
    const std::size_t triangles = mesh_.triangles.size();
    chunks_ = (triangles + triangles_a_chunk - 1) / triangles_a_chunk;
    factorise_vertices(diagonal);
  }

  std::vector<Eigen::Vector3f> solve(std::vector<Eigen::Vector3f> residual, double tolerance) {
    std::vector<Eigen::Vector3f> x(residual.size(), Eigen::Vector3f::Zero());
    std::vector<Eigen::Vector3f> direction(residual.size(), Eigen::Vector3f::Zero());
    std::vector<Eigen::Vector3f> product(residual.size(), Eigen::Vector3f::Zero());
    Residual left = step(Eigen::Array3f::Zero(), direction, product, x, residual);
    const Sums enough = tolerance * tolerance * left.size;
    Sums last = Sums::Zero();
    for (int round = 0; round < most_rounds && (left.size > enough).any(); ++round) {
      const Eigen::MatrixX3d coarse = vertices_.solve(left.on_vertices);
      const Sums now = left.scaled + left.on_vertices.cwiseProduct(coarse).colwise().sum().transpose().array();
      turn(ratio(now, last), residual, coarse, direction);
      last = now;
      left = step(ratio(now, multiply(direction, product)), direction, product, x, residual);
    }
    return x;
  }

 private:
  static Eigen::Array3f ratio(const Sums& a, const Sums& b) {
    return (b > 0).select(a / b.max(1e-300), Sums::Zero()).cast<float>();
  }

  // What a round needs to know of the residual: its square, that by the inverse of the diagonal, and its restriction.
  struct Residual {
    Sums size = Sums::Zero();
    Sums scaled = Sums::Zero();
    Eigen::MatrixX3d on_vertices;
  };

  template <class Visit>
  void for_each_triangle(Visit&& visit) const {
    parallel_for(chunks_, threads_, [&](std::size_t chunk) {
      const std::size_t end = std::min(mesh_.triangles.size(), (chunk + 1) * triangles_a_chunk);
      for (std::size_t t = chunk * triangles_a_chunk; t < end; ++t) visit(t);
    });
  }

  // Sums of chunks are added in an order that does not depend on the threads.
  static Sums total(const std::vector<Sums>& parts) {
    return std::accumulate(parts.begin(), parts.end(), Sums(Sums::Zero()));
  }

  // Goes along the direction, whose product with the matrix is given.
  Residual step(const Eigen::Array3f& alpha, const std::vector<Eigen::Vector3f>& direction,
                const std::vector<Eigen::Vector3f>& product, std::vector<Eigen::Vector3f>& x,
                std::vector<Eigen::Vector3f>& residual) const {
    std::vector<Sums> size(chunks_, Sums::Zero()), scaled(chunks_, Sums::Zero());
    std::vector<Eigen::Matrix3f> of_triangle(mesh_.triangles.size(), Eigen::Matrix3f::Zero());
    for_each_triangle([&](std::size_t t) {
      for (std::int32_t n = graph_.first[t]; n < graph_.first[t + 1]; ++n) {
        x[n].array() += alpha * direction[n].array();
        residual[n].array() -= alpha * product[n].array();
        const Sums square = residual[n].array().cast<double>().square();
        size[t / triangles_a_chunk] += square;
        scaled[t / triangles_a_chunk] += square / double{centre_[n]};
        of_triangle[t] += hats(atlas_, graph_.texel[n]) * residual[n].transpose();
      }
    });
    Residual left{total(size), total(scaled), Eigen::MatrixX3d::Zero(unknowns_, 3)};
    for (std::size_t t = 0; t < of_triangle.size(); ++t) {
      if (graph_.first[t] == graph_.first[t + 1]) continue;
      for (int k = 0; k < 3; ++k) {
        left.on_vertices.row(unknown_[mesh_.triangles[t][k]]) += of_triangle[t].row(k).cast<double>();
      }
    }
    return left;
  }

  // The next direction, from the preconditioned residual.
  void turn(const Eigen::Array3f& beta, const std::vector<Eigen::Vector3f>& residual, const Eigen::MatrixX3d& coarse,
            std::vector<Eigen::Vector3f>& direction) const {
    for_each_triangle([&](std::size_t t) {
      const std::array<Eigen::Vector3f, 3> corner = at_corners(coarse, t);
      for (std::int32_t n = graph_.first[t]; n < graph_.first[t + 1]; ++n) {
        const Eigen::Vector3f w = hats(atlas_, graph_.texel[n]);
        direction[n] = (beta * direction[n].array()).matrix() + residual[n] / centre_[n] + w[0] * corner[0] +
                       w[1] * corner[1] + w[2] * corner[2];
      }
    });
  }

  // Product of the matrix with a field, and that times the field.
  Sums multiply(const std::vector<Eigen::Vector3f>& in, std::vector<Eigen::Vector3f>& out) const {
    std::vector<Sums> parts(chunks_, Sums::Zero());
    for_each_triangle([&](std::size_t t) {
      for (std::int32_t n = graph_.first[t]; n < graph_.first[t + 1]; ++n) {
        Eigen::Vector3f sum = centre_[n] * in[n];
        for (const std::int32_t m : graph_.neighbour[n]) {
          if (m >= 0) sum -= in[m];
        }
        out[n] = sum;
        parts[t / triangles_a_chunk] += (in[n].array() * sum.array()).cast<double>();
      }
    });
    Sums curvature = total(parts);
    for (const auto& [a, b] : graph_.links) {
      out[a] -= in[b];
      out[b] -= in[a];
      curvature -= 2.0 * (in[a].array() * in[b].array()).cast<double>();
    }
    return curvature;
  }

  std::array<Eigen::Vector3f, 3> at_corners(const Eigen::MatrixX3d& coarse, std::size_t triangle) const {
    std::array<Eigen::Vector3f, 3> corner;
    for (int k = 0; k < 3; ++k) {
      const int u = unknown_[mesh_.triangles[triangle][k]];
      corner[k] = u < 0 ? Eigen::Vector3f::Zero() : Eigen::Vector3f(coarse.row(u).transpose().cast<float>());
    }
    return corner;
  }

  void factorise_vertices(std::span<const float> diagonal) {
    unknown_.assign(mesh_.vertices.size(), -1);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (graph_.first[t] == graph_.first[t + 1]) continue;
      Eigen::Vector3i u;
      for (int k = 0; k < 3; ++k) {
        int& unknown = unknown_[mesh_.triangles[t][k]];
        if (unknown < 0) unknown = unknowns_++;
        u[k] = unknown;
      }
      Eigen::Vector3d mass = Eigen::Vector3d::Constant(1e-6);  // of texels without any diagonal
      for (std::int32_t n = graph_.first[t]; n < graph_.first[t + 1]; ++n) {
        mass += double{diagonal[n]} * hats(atlas_, graph_.texel[n]).cast<double>();
      }
      std::array<Eigen::Vector2d, 3> side;  // opposite to each corner
      const Eigen::Vector3i& places = mesh_.uv_triangles[t];
      for (int k = 0; k < 3; ++k) {
        side[k] = atlas_.size * (mesh_.uv[places[(k + 2) % 3]] - mesh_.uv[places[(k + 1) % 3]]);
      }
      const double area = 0.5 * std::abs(side[0].x() * side[1].y() - side[0].y() * side[1].x());
      for (int k = 0; k < 3; ++k) {
        entries.emplace_back(u[k], u[k], mass[k]);
        for (int l = 0; l < 3; ++l) {
          if (area > 1e-9) entries.emplace_back(u[k], u[l], side[k].dot(side[l]) / (4 * area));
        }
      }
    }
    Eigen::SparseMatrix<double> matrix(unknowns_, unknowns_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    vertices_.compute(matrix);
  }

  const TriangleMesh& mesh_;
  const Atlas& atlas_;
  const TexelGraph& graph_;
  int threads_;
  std::size_t chunks_ = 0;
  std::vector<float> centre_;  // diagonal of L + D
  std::vector<int> unknown_;   // of each vertex, -1: has no texel
  int unknowns_ = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> vertices_;
};

}  // namespace

std::vector<Eigen::Vector3f> solve_on_texels(const TriangleMesh& mesh, const Atlas& atlas, const TexelGraph& graph,
                                             std::span<const float> diagonal, std::vector<Eigen::Vector3f> right,
                                             double tolerance, int threads) {
  if (graph.texel.empty()) return right;
  return Solver(mesh, atlas, graph, diagonal, threads).solve(std::move(right), tolerance);
}

}  // namespace gyre
