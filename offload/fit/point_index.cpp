// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/point_index.h"

#include <cassert>
#include <cmath>
#include <opencv2/flann.hpp>

namespace gyre {

struct PointIndex::Tree {
  using Index = cvflann::KDTreeSingleIndex<cvflann::L2_Simple<float>>;

  explicit Tree(OrientedPoints given) : points(std::move(given)) {
    coordinates.reserve(3 * points.size());
    for (const Eigen::Vector3d& p : points.positions)
      for (int k = 0; k < 3; ++k) coordinates.push_back(static_cast<float>(p[k]));
    index = std::make_unique<Index>(cvflann::Matrix<float>(coordinates.data(), points.size(), 3),
                                    cvflann::KDTreeSingleIndexParams(10, false));
    index->buildIndex();
  }

  OrientedPoints points;
  std::vector<float> coordinates;
  std::unique_ptr<Index> index;
  cvflann::SearchParams exact{cvflann::FLANN_CHECKS_UNLIMITED};
};

PointIndex::PointIndex(OrientedPoints points) {
  assert(points.size() > 0 && points.positions.size() == points.normals.size());
  tree_ = std::make_unique<Tree>(std::move(points));
}
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;
PointIndex::~PointIndex() = default;

const OrientedPoints& PointIndex::points() const {
  return tree_->points;
}

std::vector<Neighbour> PointIndex::nearest(const Eigen::Vector3d& query, int count) const {
  const std::size_t wanted = std::min<std::size_t>(count, tree_->points.size());
  std::vector<int> indices(wanted, -1);
  std::vector<float> squared(wanted);
  const Eigen::Vector3f q = query.cast<float>();
  cvflann::KNNSimpleResultSet<float> found(wanted);
  found.init(indices.data(), squared.data());
  tree_->index->findNeighbors(found, q.data(), tree_->exact);
  std::vector<Neighbour> neighbours;
  neighbours.reserve(wanted);
  for (const int i : indices)
    if (i >= 0) neighbours.push_back({i, (tree_->points.positions[i] - query).norm()});
  return neighbours;
}

std::optional<Neighbour> PointIndex::nearest_compatible(const Eigen::Vector3d& query, const Eigen::Vector3d& normal,
                                                        const MatchGate& gate) const {
  for (const Neighbour& n : nearest(query, gate.candidates)) {
    if (n.distance > gate.radius) break;
    if (tree_->points.normals[n.index].dot(normal) >= gate.min_cosine) return n;
  }
  return std::nullopt;
}

}  // namespace gyre
