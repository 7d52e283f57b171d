// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/consistency.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Other {
  const StereoView* view;
  const StereoDepth* map;
  Matrix3d rotation;  // other from reference
  Vector3d translation;
};

enum class Verdict { silent, confirms, sees_through };

struct Opinion {
  Verdict verdict = Verdict::silent;
  double depth = 0;                    // along the reference pixel's ray
  Vector3d normal = Vector3d::Zero();  // in reference coordinates
};

// True when `colour` lies within `tolerance` of the range of the four colours around array index (u, v), in every
// channel; the range makes it indifferent to where between the pixels the point falls (Birchfield and Tomasi, PAMI
// 1998).
bool same_colour(const Rgb& colour, const StereoView& view, double u, double v, int tolerance) {
  const int x = std::clamp(static_cast<int>(std::floor(u)), 0, view.width() - 2);
  const int y = std::clamp(static_cast<int>(std::floor(v)), 0, view.height() - 2);
  const std::vector<Rgb>& colours = view.levels[0].colours;
  const Rgb& a = colours[view.index(x, y)];
  const Rgb& b = colours[view.index(x + 1, y)];
  const Rgb& c = colours[view.index(x, y + 1)];
  const Rgb& d = colours[view.index(x + 1, y + 1)];
  for (int channel = 0; channel < 3; ++channel) {
    const auto [low, high] = std::minmax({a[channel], b[channel], c[channel], d[channel]});
    if (colour[channel] < low - tolerance || colour[channel] > high + tolerance) return false;
  }
  return true;
}

// What one other view says about the point ray * depth with `normal` (reference coordinates).
Opinion ask(const Other& other, const Vector3d& ray, double depth, const Vector3d& normal, const Rgb& colour,
            const Matrix3d& k, const ConfirmationOptions& options) {
  const Vector3d there = other.rotation * (ray * depth) + other.translation;
  if (there.z() <= 0) return {};
  const Matrix3d& kj = other.view->levels[0].index_from_camera;
  const Vector3d q = kj * there;
  const int x = static_cast<int>(std::floor(q.x() / q.z() + 0.5));
  const int y = static_cast<int>(std::floor(q.y() / q.z() + 0.5));
  if (x < 0 || y < 0 || x >= other.map->width || y >= other.map->height) return {};
  const std::size_t i = other.map->index(x, y);
  const PixelState state = other.map->state[i];
  if (state == PixelState::unknown || (state == PixelState::surface && other.map->cost[i] > options.max_cost))
    return {};
  const double seen = other.map->depth[i];
  if (seen > there.z() * (1.0 + options.see_through)) return {Verdict::sees_through, 0, Vector3d::Zero()};
  if (state == PixelState::beyond || std::abs(seen - there.z()) > options.max_relative_depth * there.z()) return {};

  if (!same_colour(colour, *other.view, q.x() / q.z(), q.y() / q.z(), options.max_colour_difference)) return {};

  // The neighbour's plane, met by the reference ray: both in the neighbour's coordinates.
  const Vector3d plane_normal = other.map->normal[i].cast<double>();
  const Vector3d plane_point = seen * Vector3d((x - kj(0, 2)) / kj(0, 0), (y - kj(1, 2)) / kj(1, 1), 1.0);
  const Vector3d direction = other.rotation * ray;
  const double facing = plane_normal.dot(direction);
  if (facing > -0.1 * direction.norm()) return {};
  const Vector3d normal_here = other.rotation.transpose() * plane_normal;
  if (normal_here.dot(normal) < std::cos(options.max_normal_angle_deg * std::numbers::pi / 180.0)) return {};
  const double met = plane_normal.dot(plane_point - other.translation) / facing;
  if (std::abs(met - depth) > options.max_relative_depth * depth) return {};

  // The neighbour's own point under that pixel must come back near the pixel.
  const Vector3d back = k * (other.rotation.transpose() * (plane_point - other.translation));
  if (back.z() <= 0) return {};
  const Vector3d here = k * ray;
  const double du = back.x() / back.z() - here.x();
  const double dv = back.y() / back.z() - here.y();
  // Half a pixel of the neighbour's grid is no error.
  if (std::hypot(du, dv) > options.max_pixels + 0.5) return {};
  return {Verdict::confirms, met, normal_here};
}

}  // namespace

PointCloud consistent_points(std::span<const StereoView> views, std::span<const StereoDepth> maps, int reference,
                             std::span<const int> others, const SubjectRegion& region,
                             const ConfirmationOptions& options) {
  const StereoView& view = views[reference];
  const StereoDepth& map = maps[reference];
  const Matrix3d& k = view.levels[0].index_from_camera;
  const Pose world_from_cam = view.cam_from_world.inverse();
  std::vector<Other> asked;
  for (const int j : others) {
    const Pose relative = views[j].cam_from_world * world_from_cam;
    asked.push_back({&views[j], &maps[j], relative.rotation.toRotationMatrix(), relative.translation});
  }

  PointCloud cloud;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t i = map.index(x, y);
      if (map.state[i] != PixelState::surface || map.cost[i] > options.max_cost) continue;
      const Vector3d ray((x - k(0, 2)) / k(0, 0), (y - k(1, 2)) / k(1, 1), 1.0);
      const Vector3d normal = map.normal[i].cast<double>();
      const double depth = map.depth[i];
      const Rgb& colour = view.levels[0].colours[i];
      if (!region.contains(world_from_cam * (ray * depth))) continue;
      int confirming = 1;
      int seeing_through = 0;
      double depth_sum = depth;
      double square_sum = 0;  // of the depths' differences from the pixel's own
      Vector3d normal_sum = normal;
      for (const Other& other : asked) {
        const Opinion opinion = ask(other, ray, depth, normal, colour, k, options);
        if (opinion.verdict == Verdict::sees_through) ++seeing_through;
        if (opinion.verdict != Verdict::confirms) continue;
        ++confirming;
        depth_sum += opinion.depth;
        square_sum += (opinion.depth - depth) * (opinion.depth - depth);
        normal_sum += opinion.normal;
      }
      if (confirming < options.min_views || seeing_through >= confirming) continue;
      const double mean_depth = depth_sum / confirming;
      const Vector3d point = world_from_cam * (ray * mean_depth);
      if (!region.contains(point)) continue;
      const Vector3d mean_normal = normal_sum.normalized();
      cloud.points.push_back(point.cast<float>());
      cloud.normals.push_back((world_from_cam.rotation * mean_normal).cast<float>());
      cloud.colours.push_back(colour);
      const double spread = square_sum - confirming * (mean_depth - depth) * (mean_depth - depth);
      const double across = std::max(0.1, -mean_normal.dot(ray));  // along the normal a metre of depth
      const double footprint = mean_depth / (k(0, 0) * across / ray.norm());
      cloud.deviation.push_back(static_cast<float>(std::hypot(
          across * std::sqrt(std::max(0.0, spread) / (confirming - 1)), options.match_precision * footprint)));
      const float support = 1.0F - std::exp2(-0.5F * static_cast<float>(confirming - seeing_through));
      const auto facing = static_cast<float>(std::clamp(-normal.dot(ray) / ray.norm(), 0.0, 1.0));
      cloud.confidence.push_back(support * facing * facing * std::clamp(1.0F - map.cost[i], 0.0F, 1.0F));
    }
  }
  return cloud;
}

}  // namespace gyre
