// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/world_frame.h"

#include "offload/cameras/turn_axis.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace gyre {

namespace {

// Lengths below are shares of the ring's radius, the only length known before the scale is.
constexpr double floor_thickness = 0.012;
constexpr double floor_spread = 0.144;   // of points that tell the normal of a floor, or they leave it to a guess
constexpr double platter_spread = 0.05;  // more than that of two feet
constexpr double floor_reach = 0.9;      // points farther out may belong to walls and furniture
constexpr double column_radius = 0.16;   // around the axis: head and trunk of a person the ring was walked around
constexpr double max_column_gap = 0.08;
constexpr double max_floor_tilt = 6.0 * 0.017453292519943295;
constexpr std::size_t min_floor_points = 60;
// Shares of the subject's height.
constexpr double box_half_width = 0.6;  // an A-pose spans less than the height
constexpr double box_margin = 0.05;

std::vector<Pose> registered_poses(const Scene& scene) {
  std::vector<Pose> poses;
  for (const View& view : scene.views)
    if (view.registered) poses.push_back(view.cam_from_world);
  return poses;
}

// Of the views before which the subject turned.
std::vector<Pose> turned_poses(const Scene& scene) {
  std::vector<Pose> poses;
  for (const View& view : scene.views)
    if (view.registered && view.motion == Motion::turn) poses.push_back(view.cam_from_world);
  return poses;
}

// Points three views agree on: two can agree on anything along an epipolar line.
std::vector<Eigen::Vector3d> reliable_points(const Scene& scene) {
  std::vector<Eigen::Vector3d> points;
  for (const Track& track : scene.tracks)
    if (track.triangulated && track.used_count() >= 3) points.push_back(track.point);
  return points;
}

double horizontal_distance(const Eigen::Vector3d& p) {
  return std::hypot(p.x(), p.z());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Least-squares normal, pointing up, of points near a level; nothing when they do not fix one: they must spread by
// `min_spread`, a standard deviation, in both directions of the plane.
std::optional<Eigen::Vector3d> floor_normal(const std::vector<Eigen::Vector3d>& points, double level, double thickness,
                                            double reach, double min_spread) {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  Eigen::Vector3d on_plane(0, level, 0);
  for (int step = 0; step < 5; ++step) {
    std::vector<Eigen::Vector3d> near;
    for (const Eigen::Vector3d& p : points)
      if (horizontal_distance(p) < reach && std::abs(normal.dot(p - on_plane)) < thickness) near.push_back(p);
    if (near.size() < min_floor_points) return std::nullopt;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : near) mean += p / static_cast<double>(near.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : near) scatter += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter / static_cast<double>(near.size()));
    if (std::sqrt(eigen.eigenvalues()[1]) < min_spread) return std::nullopt;
    normal = eigen.eigenvectors().col(0);
    if (normal.y() < 0) normal = -normal;
    on_plane = mean;
  }
  if (std::acos(std::min(1.0, normal.y())) > max_floor_tilt) return std::nullopt;
  return normal;
}

// The frame with +Y up and the axis through `centre`, unit and height as in the model.
Similarity upright_from_model(const Eigen::Vector3d& centre, const Eigen::Vector3d& up) {
  Similarity upright;
  upright.rotation = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitY());
  upright.translation = -(upright.rotation * centre);
  return upright;
}

std::vector<double> heights_within(const std::vector<Eigen::Vector3d>& points, double radius) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& p : points)
    if (horizontal_distance(p) < radius) heights.push_back(p.y());
  return heights;
}

}  // namespace

Eigen::Vector3d up_direction(std::span<const Pose> cam_from_world) {
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const Pose& pose : cam_from_world) mean_up -= pose.rotation.conjugate() * Eigen::Vector3d::UnitY();
  mean_up.normalize();
  Eigen::Vector3d up = mean_up;
  for (int step = 0; step < 10; ++step) {
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    double weights = 0.0;
    for (const Pose& pose : cam_from_world) {
      const Eigen::Vector3d right = pose.rotation.conjugate() * Eigen::Vector3d::UnitX();
      const double weight = step == 0 ? 1.0 : 1.0 / (std::abs(right.dot(up)) + 0.005);
      scatter += weight * right * right.transpose();
      weights += weight;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter / weights);
    if (eigen.eigenvalues()[1] < 0.02) return mean_up;
    up = eigen.eigenvectors().col(0);
    if (up.dot(mean_up) < 0) up = -up;
  }
  return up;
}

std::optional<Eigen::Vector3d> point_of_interest(std::span<const Pose> cam_from_world) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Pose& pose : cam_from_world) {
    const Eigen::Vector3d axis = pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * centre_of(pose);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(normal);
  if (eigen.eigenvalues()[0] < 1e-4 * eigen.eigenvalues()[2]) return std::nullopt;
  return normal.inverse() * right;
}

std::optional<double> floor_level(std::vector<double> heights, double thickness) {
  if (heights.size() < min_floor_points) return std::nullopt;
  std::sort(heights.begin(), heights.end());
  const std::size_t needed = std::max(min_floor_points / 2, heights.size() / 20);
  // A few false points may lie below the floor; a level above one point in ten is something on it.
  const std::size_t may_lie_below = heights.size() / 10;
  std::size_t best = 0, best_count = 0;
  for (std::size_t begin = 0, end = 0; begin <= may_lie_below; ++begin) {
    while (end < heights.size() && heights[end] < heights[begin] + thickness) ++end;
    if (end - begin > best_count) {
      best_count = end - begin;
      best = begin;
    }
  }
  if (best_count < needed) return std::nullopt;
  return heights[best + best_count / 2];
}

std::optional<ColumnTop> column_top(std::vector<double> heights, double bottom, double max_gap) {
  std::erase_if(heights, [&](double h) { return h < bottom; });
  if (heights.size() < 20) return std::nullopt;
  std::sort(heights.begin(), heights.end());
  std::size_t end = 0;
  // Every third height, so that two false points cannot bridge a gap.
  double last = bottom;
  while (end < heights.size()) {
    const std::size_t ahead = std::min(end + 2, heights.size() - 1);
    if (heights[ahead] - last > max_gap) break;
    last = heights[end++];
  }
  if (end < 20) return std::nullopt;
  // The very highest few may be false; the third from the top of hundreds is still on the crown.
  const std::size_t skipped = std::min<std::size_t>(2 + end / 2000, end - 1);
  const double top = heights[end - 1 - skipped];
  const double below = heights[end - 1 - std::min(4 * (skipped + 1), end - 1)];
  return ColumnTop{top, top - below};
}

Result<WorldFrame> find_world(const Scene& scene, double height) {
  const std::vector<Pose> turned = turned_poses(scene);
  const std::optional<TurnAxis> turn = turn_axis(turned);
  const std::vector<Pose> poses = turn ? turned : registered_poses(scene);
  const std::vector<Eigen::Vector3d> model_points = reliable_points(scene);
  const Error nothing_there{"no subject stands where the cameras look", "",
                            "keep the subject in the middle of every picture and walk around it"};
  if (poses.size() < 3 || model_points.empty()) return tl::unexpected<Error>(nothing_there);
  const auto centre = turn ? turn->point : point_of_interest(poses);
  if (!centre) return tl::unexpected<Error>(nothing_there);

  WorldFrame frame;
  Eigen::Vector3d up = turn ? turn->direction : up_direction(poses);
  Similarity upright;
  std::vector<Eigen::Vector3d> points;
  double radius = 0.0;
  std::optional<double> floor;
  // The second round uses the up direction that the floor of the first has given.
  for (int round = 0; round < 2; ++round) {
    upright = upright_from_model(*centre, up);
    std::vector<double> distances;
    for (const Pose& pose : poses) distances.push_back(horizontal_distance(upright * centre_of(pose)));
    radius = median(distances);
    points.clear();
    for (const Eigen::Vector3d& p : model_points) points.push_back(upright * p);
    floor = floor_level(heights_within(points, floor_reach * radius), floor_thickness * radius);
    if (!floor || round == 1) break;
    const auto normal = floor_normal(points, *floor, 1.5 * floor_thickness * radius, floor_reach * radius,
                                     (turn ? platter_spread : floor_spread) * radius);
    if (turn) {
      // The room's floor does not turn with the subject. What does is a platter, which tells up less well than the
      // axis, or else only the subject's own feet.
      if (!normal) floor.reset();
      break;
    }
    if (!normal) break;
    up = upright.rotation.conjugate() * *normal;
  }

  std::vector<double> column = heights_within(points, column_radius * radius);
  if (column.size() < 20) return tl::unexpected<Error>(nothing_there);
  frame.has_floor = floor.has_value();
  double bottom_uncertainty = 0.25 * floor_thickness * radius;
  if (!floor) {
    // Nothing to stand on is seen: the subject's own lowest points, found as its highest are.
    const double middle = median(column);
    std::vector<double> depths;
    for (const double h : column) depths.push_back(-h);
    const auto bottom = column_top(depths, -middle, max_column_gap * radius);
    if (!bottom) return tl::unexpected<Error>(nothing_there);
    floor = -bottom->height;
    bottom_uncertainty = bottom->uncertainty;
  }
  const auto top = column_top(column, *floor, max_column_gap * radius);
  if (!top || top->height - *floor < max_column_gap * radius) return tl::unexpected<Error>(nothing_there);

  const double model_height = top->height - *floor;
  const double scale = height / model_height;
  Similarity scaled;
  scaled.scale = scale;
  scaled.translation = Eigen::Vector3d(0, -scale * *floor, 0);
  frame.world_from_model = scaled * upright;
  frame.height_uncertainty = std::hypot(top->uncertainty, bottom_uncertainty) / model_height;
  frame.ring_radius = scale * radius;
  const double half = std::min(box_half_width * height, 0.95 * frame.ring_radius);
  frame.box = Eigen::AlignedBox3d(Eigen::Vector3d(-half, -0.5 * box_margin * height, -half),
                                  Eigen::Vector3d(half, (1 + box_margin) * height, half));
  return frame;
}

void move_world(Scene& scene, const Similarity& new_from_old) {
  for (View& view : scene.views)
    if (view.registered) view.cam_from_world = cam_from_moved_world(view.cam_from_world, new_from_old);
  for (Track& track : scene.tracks)
    if (track.triangulated) track.point = new_from_old * track.point;
}

}  // namespace gyre
