// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/world_frame.h"

#include "common/geometry/quantile.h"
#include "offload/cameras/sight_lines.h"
#include "offload/cameras/turn_axis.h"

#include <spdlog/spdlog.h>
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
// Metres; what people, and children who can stand, are.
constexpr double least_stature = 0.3;
constexpr double largest_stature = 2.6;
// Standard deviation of adults' stature, both sexes together, as a share of its mean (Gordon et al., ANSUR II, 2014).
constexpr double stature_spread = 0.055;
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

// Of a normal distribution, from the median distance to the median.
double robust_deviation(const std::vector<double>& values) {
  const double middle = median(values);
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - middle));
  return 1.4826 * median(std::move(distances));
}

// Normal of a board that lies flat, in the upright frame.
std::optional<Eigen::Vector3d> lying_board(const std::optional<PlacedBoard>& board, const Similarity& upright) {
  if (!board) return std::nullopt;
  const Eigen::Vector3d normal = upright.rotation * board->normal;
  if (std::acos(std::clamp(normal.y(), -1.0, 1.0)) > max_floor_tilt) return std::nullopt;
  return normal;
}

struct Scale {
  double metres = 0.0;  // a unit of the model
  double uncertainty = 0.0;
  ScaleSource source = ScaleSource::height;
};

// height: of the subject, model; its uncertainty as a share. radii: of the cameras, model.
Scale choose_scale(const KnownLengths& known, double height, double height_uncertainty,
                   const std::vector<double>& radii) {
  std::vector<Scale> measured;
  if (known.board) measured.push_back({known.board->scale, known.board->uncertainty, ScaleSource::board});
  if (known.turntable_radius > 0) {
    const double radius = median(radii);
    measured.push_back(
        {known.turntable_radius / radius, robust_deviation(radii) / radius, ScaleSource::turntable_radius});
  }
  for (const Scale& scale : measured) {
    const double stature = scale.metres * height;
    if (stature > least_stature && stature < largest_stature) return scale;
    spdlog::warn("the scale of the {} would make the subject {:.2f} m tall: it is not used", name_of(scale.source),
                 stature);
  }
  if (!known.stature_assumed) return {known.stature / height, height_uncertainty, ScaleSource::height};
  return {known.stature / height, std::hypot(height_uncertainty, stature_spread), ScaleSource::assumed_height};
}

}  // namespace

std::string_view name_of(ScaleSource source) {
  switch (source) {
    case ScaleSource::board:
      return "board";
    case ScaleSource::turntable_radius:
      return "turntable-radius";
    case ScaleSource::height:
      return "height";
    case ScaleSource::assumed_height:
      break;
  }
  return "assumed-height";
}

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

std::optional<ColumnTop> column_top(std::vector<double> heights, double bottom, double max_gap,
                                    const std::function<bool(double, double)>& filled) {
  std::erase_if(heights, [&](double h) { return h < bottom; });
  if (heights.size() < 20) return std::nullopt;
  std::sort(heights.begin(), heights.end());
  std::size_t end = 0;
  // Every third height, so that two false points cannot bridge a gap.
  double last = bottom;
  while (end < heights.size()) {
    const std::size_t ahead = std::min(end + 2, heights.size() - 1);
    if (heights[ahead] - last > max_gap && !filled(last, heights[ahead])) break;
    last = heights[end++];
  }
  if (end < 20) return std::nullopt;
  // The very highest few may be false; the third from the top of hundreds is still on the crown.
  const std::size_t skipped = std::min<std::size_t>(2 + end / 2000, end - 1);
  const double top = heights[end - 1 - skipped];
  const double below = heights[end - 1 - std::min(4 * (skipped + 1), end - 1)];
  return ColumnTop{top, top - below};
}

Result<WorldFrame> find_world(const Scene& scene, const KnownLengths& known) {
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
  std::vector<double> distances;
  double radius = 0.0;
  bool has_floor = false;
  double ground = 0.0;
  // The second round uses the up direction that the floor of the first has given.
  for (int round = 0; round < 2; ++round) {
    upright = upright_from_model(*centre, up);
    distances.clear();
    for (const Pose& pose : poses) distances.push_back(horizontal_distance(upright * centre_of(pose)));
    radius = median(distances);
    points.clear();
    for (const Eigen::Vector3d& p : model_points) points.push_back(upright * p);
    const auto floor = floor_level(heights_within(points, floor_reach * radius), floor_thickness * radius);
    has_floor = floor.has_value();
    if (floor) ground = *floor;
    if (round == 1) break;
    const auto normal = floor ? floor_normal(points, *floor, 1.5 * floor_thickness * radius, floor_reach * radius,
                                             (turn ? platter_spread : floor_spread) * radius)
                              : lying_board(known.board, upright);
    if (turn) {
      // The room's floor does not turn with the subject. What does is a platter, which tells up less well than the
      // axis, or else only the subject's own feet.
      has_floor = has_floor && normal;
      break;
    }
    if (!normal) break;
    up = upright.rotation.conjugate() * *normal;
  }

  std::vector<double> column = heights_within(points, column_radius * radius);
  if (column.size() < 20) return tl::unexpected<Error>(nothing_there);
  const std::vector<SightLine> lines = lines_past_axis(scene, upright, radius);
  const auto filled = [&](double low, double high) { return is_solid(lines, low, high, radius); };
  frame.has_floor = has_floor;
  double bottom_uncertainty = 0.25 * floor_thickness * radius;
  if (!has_floor) {
    // Nothing to stand on is seen: the subject's own lowest points, found as its highest are.
    const double middle = median(column);
    std::vector<double> depths;
    for (const double h : column) depths.push_back(-h);
    const auto bottom = column_top(depths, -middle, max_column_gap * radius,
                                   [&](double from, double to) { return filled(-to, -from); });
    if (!bottom) return tl::unexpected<Error>(nothing_there);
    ground = -bottom->height;
    bottom_uncertainty = bottom->uncertainty;
    // A board at their level lies on the floor; higher up it may be on a table.
    if (lying_board(known.board, upright)) {
      const double level = (upright * known.board->centre).y();
      frame.has_floor = std::abs(level - ground) < max_column_gap * radius;
      if (frame.has_floor) ground = level;
    }
  }
  const auto top = column_top(column, ground, max_column_gap * radius, filled);
  if (!top || top->height - ground < max_column_gap * radius) return tl::unexpected<Error>(nothing_there);

  const double model_height = top->height - ground;
  const double ends = std::hypot(top->uncertainty, bottom_uncertainty) / model_height;
  const Scale scale = choose_scale(known, model_height, ends, distances);
  frame.scale_source = scale.source;
  frame.scale_uncertainty = scale.uncertainty;
  const bool measured = scale.source == ScaleSource::board || scale.source == ScaleSource::turntable_radius;
  frame.height = scale.metres * model_height;
  frame.height_uncertainty = measured ? std::hypot(scale.uncertainty, ends) : scale.uncertainty;
  frame.ring_radius = scale.metres * radius;
  Similarity scaled;
  scaled.scale = scale.metres;
  scaled.translation = Eigen::Vector3d(0, -scale.metres * ground, 0);
  frame.world_from_model = scaled * upright;
  const double half = std::min(box_half_width * frame.height, 0.95 * frame.ring_radius);
  frame.box = Eigen::AlignedBox3d(Eigen::Vector3d(-half, -0.5 * box_margin * frame.height, -half),
                                  Eigen::Vector3d(half, (1 + box_margin) * frame.height, half));
  return frame;
}

void move_world(Scene& scene, const Similarity& new_from_old) {
  for (View& view : scene.views)
    if (view.registered) view.cam_from_world = cam_from_moved_world(view.cam_from_world, new_from_old);
  for (Track& track : scene.tracks)
    if (track.triangulated) track.point = new_from_old * track.point;
}

}  // namespace gyre
