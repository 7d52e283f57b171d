// SPDX-License-Identifier: Apache-2.0
// Closest point on a triangle mesh, and what a ray hits, by Embree.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace gyre {

struct TriangleMesh;

// Where on the surface something was found.
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of the triangle, unit, by its winding; zero for a degenerate one
  std::int32_t triangle = -1;
  Eigen::Vector2d weights = Eigen::Vector2d::Zero();  // barycentric weights of corners 1 and 2
  double distance = 0.0;                              // metres from the query point, or along the ray
};

// A bounding volume hierarchy over a copy of the mesh's vertices and triangles. Queries are const and may run on many
// threads at once. Coordinates are single precision inside the hierarchy: for a body at the origin, exact to 1e-7 m.
class ClosestPoint {
 public:
  // Every index of `triangles` must be valid.
  ClosestPoint(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles);
  explicit ClosestPoint(const TriangleMesh& mesh);
  ClosestPoint(ClosestPoint&&) noexcept;
  ClosestPoint& operator=(ClosestPoint&&) noexcept;
  ~ClosestPoint();

  // The nearest surface point no further than `radius` metres (Ericson, Real-Time Collision Detection, 2005, 5.1.5
  // inside each visited triangle); nothing when there is none.
  std::optional<SurfacePoint> nearest(const Eigen::Vector3d& query,
                                      double radius = std::numeric_limits<double>::infinity()) const;

  // The first surface point at more than `near` along the ray; `direction` need not be a unit vector, and distances
  // count in its length.
  std::optional<SurfacePoint> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                        double near = 0.0) const;

  // True when something lies strictly between the two points; the ends' own surroundings of `margin` metres are
  // ignored.
  bool occluded(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double margin) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace gyre
