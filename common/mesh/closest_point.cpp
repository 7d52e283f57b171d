// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/closest_point.h"

#include "common/mesh/mesh.h"
#include "common/mesh/triangle.h"

#include <Eigen/Geometry>
#include <cassert>
#include <new>
#include <vector>
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace gyre {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

}  // namespace

struct ClosestPoint::Scene {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  Scene() = default;
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  SurfacePoint point(std::int32_t triangle, const Eigen::Vector2d& weights) const {
    const Eigen::Vector3i& t = triangles[triangle];
    const Eigen::Vector3d &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    SurfacePoint found;
    found.position = a + weights[0] * (b - a) + weights[1] * (c - a);
    found.normal = (b - a).cross(c - a);
    if (const double length = found.normal.norm(); length > 0) found.normal /= length;
    found.triangle = triangle;
    found.weights = weights;
    return found;
  }
};

namespace {

struct NearestQuery {
  const std::vector<Eigen::Vector3d>& vertices;
  const std::vector<Eigen::Vector3i>& triangles;
  Eigen::Vector3d point;
  double squared = 0.0;
  std::int32_t triangle = -1;
  Eigen::Vector2d weights = Eigen::Vector2d::Zero();
};

// Embree calls this for each triangle whose bounds touch the query sphere; a shrunk radius prunes the rest. Equal
// distances go to the lower triangle, so that the answer does not depend on the order of the visit.
bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& query = *static_cast<NearestQuery*>(arguments->userPtr);
  const auto id = static_cast<std::int32_t>(arguments->primID);
  const Eigen::Vector3i& t = query.triangles[id];
  const Eigen::Vector3d &a = query.vertices[t[0]], &b = query.vertices[t[1]], &c = query.vertices[t[2]];
  const Eigen::Vector2d weights = closest_weights(query.point, a, b, c).tail<2>();
  const double squared = (a + weights[0] * (b - a) + weights[1] * (c - a) - query.point).squaredNorm();
  if (squared > query.squared || (squared == query.squared && query.triangle >= 0 && id > query.triangle)) return false;
  query.squared = squared;
  query.triangle = id;
  query.weights = weights;
  // A little wider than the distance, so that rounding to float never prunes an equal or nearer triangle.
  const float radius = static_cast<float>(std::sqrt(squared)) * 1.00001f + 1e-6f;
  if (radius >= arguments->query->radius) return false;
  arguments->query->radius = radius;
  return true;
}

RTCRay ray_of(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xffffffffu;
  return ray;
}

}  // namespace

ClosestPoint::ClosestPoint(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles)
    : scene_(std::make_unique<Scene>()) {
  Scene& s = *scene_;
  s.vertices.assign(vertices.begin(), vertices.end());
  s.triangles.assign(triangles.begin(), triangles.end());
  // One thread builds: the meshes are small, and threads of other queries must not be joined by Embree's pool.
  s.device = rtcNewDevice("threads=1,set_affinity=0");
  if (s.device == nullptr) throw std::bad_alloc();
  s.scene = rtcNewScene(s.device);
  rtcSetSceneFlags(s.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(s.scene, RTC_BUILD_QUALITY_MEDIUM);
  if (!s.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), s.vertices.size()));
    auto* corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), s.triangles.size()));
    if (points == nullptr || corners == nullptr) throw std::bad_alloc();
    for (std::size_t i = 0; i < s.vertices.size(); ++i)
      for (int k = 0; k < 3; ++k) points[3 * i + k] = static_cast<float>(s.vertices[i][k]);
    for (std::size_t i = 0; i < s.triangles.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        assert(s.triangles[i][k] >= 0 && static_cast<std::size_t>(s.triangles[i][k]) < s.vertices.size());
        corners[3 * i + k] = static_cast<std::uint32_t>(s.triangles[i][k]);
      }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(s.scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(s.scene);
}

ClosestPoint::ClosestPoint(const TriangleMesh& mesh) : ClosestPoint(mesh.vertices, mesh.triangles) {}
ClosestPoint::ClosestPoint(ClosestPoint&&) noexcept = default;
ClosestPoint& ClosestPoint::operator=(ClosestPoint&&) noexcept = default;
ClosestPoint::~ClosestPoint() = default;

std::optional<SurfacePoint> ClosestPoint::nearest(const Eigen::Vector3d& query, double radius) const {
  NearestQuery state{scene_->vertices, scene_->triangles, query, radius * radius};
  RTCPointQuery sphere{};
  sphere.x = static_cast<float>(query.x());
  sphere.y = static_cast<float>(query.y());
  sphere.z = static_cast<float>(query.z());
  sphere.radius = std::isfinite(radius) ? static_cast<float>(radius) * 1.00001f + 1e-6f : infinity;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_->scene, &sphere, &context, visit, &state);
  if (state.triangle < 0) return std::nullopt;
  SurfacePoint found = scene_->point(state.triangle, state.weights);
  found.distance = std::sqrt(state.squared);
  return found;
}

std::optional<SurfacePoint> ClosestPoint::first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                                    double near) const {
  RTCRayHit hit{};
  hit.ray = ray_of(origin, direction, near, infinity);
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if __has_include(<embree4/rtcore.h>)
  rtcIntersect1(scene_->scene, &hit);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_->scene, &context, &hit);
#endif
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  SurfacePoint found = scene_->point(static_cast<std::int32_t>(hit.hit.primID), {hit.hit.u, hit.hit.v});
  found.distance = hit.ray.tfar;
  return found;
}

bool ClosestPoint::occluded(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double margin) const {
  const Eigen::Vector3d direction = to - from;
  const double length = direction.norm();
  if (length <= 2 * margin) return false;
  RTCRay ray = ray_of(from, direction / length, margin, length - margin);
#if __has_include(<embree4/rtcore.h>)
  rtcOccluded1(scene_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_->scene, &context, &ray);
#endif
  return ray.tfar < 0;
}

}  // namespace gyre
