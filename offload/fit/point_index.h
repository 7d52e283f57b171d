// SPDX-License-Identifier: Apache-2.0
// Exact nearest neighbours among oriented points (FLANN's single k-d tree).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

// Points with unit normals, each with the weight of its evidence.
struct OrientedPoints {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> normals;
  std::vector<double> weights;  // in (0, 1]; empty: all 1
  std::size_t size() const { return positions.size(); }
  double weight(std::size_t i) const { return weights.empty() ? 1.0 : weights[i]; }
};

// What counts as a counterpart.
struct MatchGate {
  double radius = 0.1;      // metres
  double min_cosine = 0.5;  // between the two normals
  int candidates = 8;       // nearest points whose normals are looked at
};

struct Neighbour {
  int index = -1;
  double distance = 0.0;  // metres
};

// Queries are const and may run on many threads at once. Positions are single precision inside the tree.
class PointIndex {
 public:
  // Keeps a copy. At least one point.
  explicit PointIndex(OrientedPoints points);
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;
  ~PointIndex();

  const OrientedPoints& points() const;

  // The `count` nearest points (fewer when there are fewer), nearest first.
  std::vector<Neighbour> nearest(const Eigen::Vector3d& query, int count) const;

  // Of the gate's candidates, the nearest whose normal agrees; nothing when none does within the radius.
  std::optional<Neighbour> nearest_compatible(const Eigen::Vector3d& query, const Eigen::Vector3d& normal,
                                              const MatchGate& gate) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace gyre
