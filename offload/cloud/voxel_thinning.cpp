// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/voxel_thinning.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace gyre {
namespace {

// 20 bits a coordinate and 3 for the side: cubes of a millimetre over a kilometre.
std::uint64_t voxel_key(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, double size) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(point[axis] / size)) + (std::int64_t{1} << 19);
    key = key << 20U | (static_cast<std::uint64_t>(cell) & 0xFFFFFU);
  }
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return key << 3U | static_cast<std::uint64_t>(2 * axis + (normal[axis] < 0 ? 1 : 0));
}

}  // namespace

PointCloud thin_by_voxels(const PointCloud& cloud, double size) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(cloud.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = {voxel_key(cloud.points[i], cloud.normals[i], size), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());

  PointCloud thin;
  for (std::size_t first = 0; first < order.size();) {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d colour = Eigen::Vector3d::Zero();
    double weight_sum = 0;
    double deviation = 0;
    float confidence = 0;
    std::size_t last = first;
    for (; last < order.size() && order[last].first == order[first].first; ++last) {
      const std::size_t i = order[last].second;
      const double weight = std::max(1e-3, static_cast<double>(cloud.confidence[i]));
      weight_sum += weight;
      point += weight * cloud.points[i].cast<double>();
      normal += weight * cloud.normals[i].cast<double>();
      colour += weight * cloud.colours[i].cast<double>();
      deviation += weight * cloud.deviation[i];
      confidence = std::max(confidence, cloud.confidence[i]);
    }
    point /= weight_sum;
    normal.normalize();
    colour /= weight_sum;
    deviation /= weight_sum;
    double scatter = 0;  // variance of the points across the surface
    for (; first < last; ++first) {
      const std::size_t i = order[first].second;
      const double off = normal.dot(cloud.points[i].cast<double>() - point);
      scatter += std::max(1e-3, static_cast<double>(cloud.confidence[i])) / weight_sum * off * off;
    }
    thin.points.push_back(point.cast<float>());
    thin.normals.push_back(normal.cast<float>());
    thin.colours.push_back((colour.array() + 0.5).cast<std::uint8_t>().matrix());
    thin.confidence.push_back(confidence);
    thin.deviation.push_back(static_cast<float>(std::sqrt(deviation * deviation + scatter)));
  }
  return thin;
}

}  // namespace gyre
