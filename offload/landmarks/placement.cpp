// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/placement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace gyre {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double least_deviation = 0.001;  // metres: cameras and cloud share errors that more views do not average out

struct Ray {
  const PixelDetection* detection = nullptr;
  Vector3d origin = Vector3d::Zero(), direction = Vector3d::UnitZ();
  double angle = 0.0;  // standard deviation of the direction, radians
  std::optional<CloudHit> hit;

  Vector3d hit_point() const { return origin + hit->depth * direction; }
};

struct Estimate {
  Vector3d position = Vector3d::Zero();
  Matrix3d covariance = Matrix3d::Identity();
  double misfit = 0.0;  // mean squared distance from the rays in standard deviations
};

std::optional<Estimate> combine(const std::vector<const Ray*>& rays, bool with_hits) {
  // Depths weigh the rays; one more round settles them.
  Vector3d guess = Vector3d::Zero();
  for (const Ray* ray : rays)
    guess += (ray->origin + (ray->hit ? ray->hit->depth : 1.5) * ray->direction) / static_cast<double>(rays.size());
  Estimate estimate;
  for (int round = 0; round < 3; ++round) {
    Matrix3d information = Matrix3d::Zero();
    Vector3d vector = Vector3d::Zero();
    for (const Ray* ray : rays) {
      const Matrix3d along = ray->direction * ray->direction.transpose();
      const double depth = std::max((guess - ray->origin).dot(ray->direction), 0.05);
      const Matrix3d across = (Matrix3d::Identity() - along) / std::pow(ray->angle * depth, 2);
      information += across;
      vector += across * ray->origin;
      if (!with_hits) continue;
      const Matrix3d deep = along / std::pow(ray->hit->deviation, 2);
      information += deep;
      vector += deep * ray->hit_point();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(information);
    if (axes.eigenvalues()[0] < 1e-6 * axes.eigenvalues()[2]) return std::nullopt;  // parallel rays
    estimate.covariance = information.inverse();
    estimate.position = estimate.covariance * vector;
    guess = estimate.position;
  }
  for (const Ray* ray : rays) {
    const Vector3d offset = estimate.position - ray->origin;
    const double depth = offset.dot(ray->direction);
    if (depth < 0.05) return std::nullopt;
    estimate.misfit +=
        std::pow((offset - depth * ray->direction).norm() / (ray->angle * depth), 2) / static_cast<double>(rays.size());
  }
  estimate.covariance *= std::max(1.0, estimate.misfit);
  estimate.covariance += least_deviation * least_deviation * Matrix3d::Identity();
  return estimate;
}

PlacedLandmark finished(const Subject& subject, const std::vector<const Ray*>& rays, const Estimate& estimate,
                        const std::string& source) {
  PlacedLandmark mark{rays.front()->detection->name, estimate.position, estimate.covariance, source, {}};
  for (const Ray* ray : rays) mark.views.push_back(subject.views[ray->detection->view].name);
  return mark;
}

}  // namespace

std::optional<CloudHit> hit_cloud(const PointCloud& cloud, const Vector3d& origin, const Vector3d& direction,
                                  double pixel_radius, const PlacementOptions& options) {
  struct Near {
    double depth, beside;
  };
  std::vector<Near> near;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d offset = cloud.points[i].cast<double>() - origin;
    const double depth = offset.dot(direction);
    if (depth <= 0) continue;
    const double radius = std::max(options.support_radius, pixel_radius * depth);
    const double beside = offset.squaredNorm() - depth * depth;
    if (beside > radius * radius) continue;
    if (!cloud.normals.empty() && cloud.normals[i].cast<double>().dot(direction) > 0.1) continue;
    near.push_back({depth, std::sqrt(std::max(beside, 0.0)) / radius});
  }
  std::sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.depth < b.depth; });
  constexpr double thickness = 0.012;  // metres along the ray of what counts as one surface
  for (std::size_t first = 0; first < near.size(); ++first) {
    std::size_t last = first;
    while (last < near.size() && near[last].depth < near[first].depth + thickness) ++last;
    if (static_cast<int>(last - first) < options.support_points) continue;
    // Points next to the ray count most: beside a fold its edges lie before it.
    const auto weight_of = [&](std::size_t i) { return std::pow(1.0 - 0.9 * near[i].beside * near[i].beside, 3); };
    double sum = 0, weights = 0;
    for (std::size_t i = first; i < last; ++i) {
      const double weight = weight_of(i);
      sum += weight * near[i].depth;
      weights += weight;
    }
    const double depth = sum / weights;
    double scatter = 0;
    for (std::size_t i = first; i < last; ++i) scatter += weight_of(i) * std::pow(near[i].depth - depth, 2) / weights;
    return CloudHit{depth, std::max(std::sqrt(scatter), least_deviation)};
  }
  return std::nullopt;
}

tl::expected<PlacedLandmark, std::string> place_landmark(const Subject& subject,
                                                         std::span<const PixelDetection> detections,
                                                         const std::string& source, const PlacementOptions& options) {
  std::vector<Ray> rays;
  for (const PixelDetection& detection : detections) {
    const LandmarkView& view = subject.views[detection.view];
    Ray ray{&detection, view.centre(), view.ray(detection.pixel),
            detection.deviation / (0.5 * (view.camera.fx + view.camera.fy)), std::nullopt};
    ray.hit = hit_cloud(subject.cloud, ray.origin, ray.direction, ray.angle, options);
    rays.push_back(ray);
  }
  if (rays.empty()) return tl::unexpected(std::string("no picture shows it"));

  std::vector<const Ray*> best;
  for (const Ray& centre : rays) {
    if (!centre.hit) continue;
    std::vector<const Ray*> group;
    for (const Ray& ray : rays)
      if (ray.hit && (ray.hit_point() - centre.hit_point()).norm() <= options.agreement) group.push_back(&ray);
    if (group.size() > best.size()) best = group;
  }
  const auto hits = std::count_if(rays.begin(), rays.end(), [](const Ray& ray) { return ray.hit.has_value(); });
  if (!best.empty() && 2 * best.size() > static_cast<std::size_t>(hits)) {
    if (const auto estimate = combine(best, true)) return finished(subject, best, *estimate, source);
  }
  if (hits > 0) return tl::unexpected(std::string("the pictures that show it do not agree where it is"));
  if (rays.size() < 2) return tl::unexpected(std::string("the cloud has a hole where the picture shows it"));
  std::vector<const Ray*> all;
  for (const Ray& ray : rays) all.push_back(&ray);
  const auto estimate = combine(all, false);
  if (!estimate || estimate->misfit > 9)
    return tl::unexpected(std::string("the cloud has a hole there and the pictures do not agree where it is"));
  return finished(subject, all, *estimate, source);
}

}  // namespace gyre
