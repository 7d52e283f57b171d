// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/triangulation.h"

#include "common/parallel/parallel.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace gyre {

namespace {

// Pairs of rays tried per track; long tracks agree with themselves after a few.
constexpr int max_hypotheses = 12;

Ray ray_of(const Scene& scene, const Observation& o) {
  const Pose world_from_cam = scene.view_of(o).cam_from_world.inverse();
  return {world_from_cam.translation, world_from_cam.rotation * scene.normalised_of(o).homogeneous().normalized()};
}

// Two Gauss-Newton steps on the normalised reprojection error of the used observations.
void refine(const Scene& scene, const Track& track, Eigen::Vector3d& point) {
  for (int step = 0; step < 2; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const Pose& pose = scene.view_of(o).cam_from_world;
      const Eigen::Vector3d p = pose * point;
      if (p.z() <= 0) return;
      Eigen::Matrix<double, 2, 3> projection;
      projection << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
      const Eigen::Matrix<double, 2, 3> jacobian = projection * pose.rotation.toRotationMatrix();
      const Eigen::Vector2d residual = p.hnormalized() - scene.normalised_of(o);
      normal += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * residual;
    }
    const Eigen::Vector3d delta = normal.ldlt().solve(gradient);
    if (!delta.allFinite()) return;
    point -= delta;
  }
}

int mark_used(const Scene& scene, Track& track, const Eigen::Vector3d& point, double max_error) {
  int used = 0;
  for (Observation& o : track.observations) {
    o.used = scene.view_of(o).registered && reprojection_error(scene, o, point) < max_error;
    if (o.used) ++used;
  }
  return used;
}

bool has_angle(const Scene& scene, const Track& track, double min_angle) {
  std::vector<Eigen::Vector3d> directions;
  for (const Observation& o : track.observations)
    if (o.used) directions.push_back((track.point - centre_of(scene.view_of(o).cam_from_world)).normalized());
  const double max_cosine = std::cos(min_angle);
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t j = i + 1; j < directions.size(); ++j)
      if (directions[i].dot(directions[j]) < max_cosine) return true;
  return false;
}

void forget(Track& track) {
  track.triangulated = false;
  for (Observation& o : track.observations) o.used = false;
}

int extend_point(const Scene& scene, Track& track, const TriangulationOptions& options) {
  if (!track.triangulated) return triangulate(scene, track, options) ? track.used_count() : 0;
  int added = 0;
  for (Observation& o : track.observations) {
    if (o.used || !scene.view_of(o).registered) continue;
    o.used = reprojection_error(scene, o, track.point) < options.max_error;
    if (o.used) ++added;
  }
  return added;
}

}  // namespace

double angle_between_rays(const Ray& a, const Ray& b) {
  return std::atan2(a.direction.cross(b.direction).norm(), a.direction.dot(b.direction));
}

std::optional<Eigen::Vector3d> intersect_rays(std::span<const Ray> rays) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    normal += across;
    right += across * ray.origin;
  }
  Eigen::Matrix3d inverse;
  bool invertible = false;
  normal.computeInverseWithCheck(inverse, invertible, 1e-12);
  if (!invertible) return std::nullopt;
  return inverse * right;
}

bool triangulate(const Scene& scene, Track& track, const TriangulationOptions& options) {
  forget(track);
  std::vector<Ray> rays;
  for (const Observation& o : track.observations)
    if (scene.view_of(o).registered) rays.push_back(ray_of(scene, o));
  const int count = static_cast<int>(rays.size());
  if (count < 2) return false;

  // Views far apart in the list see the point under the largest angles: try those pairs first.
  int best_used = 0, tried = 0;
  Eigen::Vector3d best;
  for (int apart = count - 1; apart >= 1 && tried < max_hypotheses; --apart) {
    for (int i = 0; i + apart < count && tried < max_hypotheses; ++i) {
      const std::array<Ray, 2> two{rays[static_cast<std::size_t>(i)], rays[static_cast<std::size_t>(i + apart)]};
      if (angle_between_rays(two[0], two[1]) < options.min_angle) continue;
      ++tried;
      const auto point = intersect_rays(two);
      if (!point) continue;
      const int used = mark_used(scene, track, *point, options.max_error);
      if (used <= best_used) continue;
      best_used = used;
      best = *point;
      if (used == count) tried = max_hypotheses;
    }
  }
  if (best_used < 2) {
    forget(track);
    return false;
  }
  mark_used(scene, track, best, options.max_error);
  refine(scene, track, best);
  track.point = best;
  track.triangulated =
      mark_used(scene, track, best, options.max_error) >= 2 && has_angle(scene, track, options.min_angle);
  if (!track.triangulated) forget(track);
  return track.triangulated;
}

int filter_points(Scene& scene, const TriangulationOptions& options) {
  int dropped = 0;
  for (Track& track : scene.tracks) {
    if (!track.triangulated) continue;
    int used = 0;
    for (Observation& o : track.observations) {
      if (!o.used) continue;
      if (scene.view_of(o).registered && reprojection_error(scene, o, track.point) < options.max_error) {
        ++used;
      } else {
        o.used = false;
        ++dropped;
      }
    }
    if (used >= 2 && has_angle(scene, track, options.min_angle)) continue;
    dropped += used;
    forget(track);
  }
  return dropped;
}

int extend_points(Scene& scene, const TriangulationOptions& options, int threads) {
  std::vector<int> added(scene.tracks.size(), 0);
  parallel_for(scene.tracks.size(), threads,
               [&](std::size_t i) { added[i] = extend_point(scene, scene.tracks[i], options); });
  return std::accumulate(added.begin(), added.end(), 0);
}

int extend_points_of_view(Scene& scene, int view, const TriangulationOptions& options) {
  int added = 0;
  for (const int track : scene.views[static_cast<std::size_t>(view)].track_of)
    if (track >= 0) added += extend_point(scene, scene.tracks[static_cast<std::size_t>(track)], options);
  return added;
}

}  // namespace gyre
