// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/sway.h"

#include "common/geometry/quantile.h"
#include "offload/cameras/bundle_adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace gyre {
namespace {

using Eigen::Vector3d;

constexpr double prior = 0.01;         // metres, how far somebody who tries to stand still moves
constexpr double reach = 20.0;         // pixels; keypoints farther from their point are another thing
constexpr double loss_width = 1.0;     // pixels, of Cauchy's loss
constexpr double floor_margin = 0.03;  // metres above the floor that may be the floor's
constexpr int least_features = 20;     // of the subject and of the room, in a view
constexpr int rounds = 20;
constexpr int room_points_per_view = 300;  // as many fix a pose; more only take time
constexpr double agreement = 4.0;          // pixels; a larger residual is a wrong match

enum class Side { subject, room, neither };

Side side_of(const Vector3d& point, const Eigen::AlignedBox3d& box) {
  if (!box.contains(point)) return Side::room;
  const Vector3d from_axis = point - box.center();
  const double radius = 0.5 * std::max(box.sizes().x(), box.sizes().z());
  const bool inside = std::hypot(from_axis.x(), from_axis.z()) < radius && point.y() > floor_margin;
  return inside ? Side::subject : Side::neither;
}

// The scene without tracks of other sides.
Scene only(const Scene& scene, Side side, const Eigen::AlignedBox3d& box) {
  Scene part = scene;
  for (Track& track : part.tracks) track.triangulated = track.triangulated && side_of(track.point, box) == side;
  return part;
}

// Where a point is seen, and how that changes with the point.
struct Sight {
  Eigen::Vector2d residual;              // pixels
  Eigen::Matrix<double, 2, 3> by_point;  // world
};

std::optional<Sight> look(const Scene& scene, const Observation& o, const Vector3d& point) {
  const View& view = scene.view_of(o);
  const Camera& camera = scene.camera_of(view);
  const Vector3d p = view.cam_from_world * point;
  const auto pixel = camera.project(p);
  if (!pixel) return std::nullopt;
  // The lens bends little over a millimetre: its derivative is that of the pinhole, the residual has all of it.
  Eigen::Matrix<double, 2, 3> by_camera;
  by_camera << camera.fx / p.z(), 0, -camera.fx * p.x() / (p.z() * p.z()), 0, camera.fy / p.z(),
      -camera.fy * p.y() / (p.z() * p.z());
  return Sight{scene.pixel_of(o) - *pixel, by_camera * view.cam_from_world.rotation.toRotationMatrix()};
}

double weight_of(const Eigen::Vector2d& residual) {
  return residual.norm() > reach ? 0.0 : 1.0 / (1.0 + residual.squaredNorm() / (loss_width * loss_width));
}

// One step's normal equations, reduced to the shifts.
struct Reduced {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

// An observation's contribution to the equations of its point.
struct Term {
  int view = 0;
  Eigen::Matrix3d cross;
};

// The points' part of a step, to be completed once the shifts' part is known.
struct PointStep {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  std::vector<Term> terms;
};

// Moves the points and shifts once. Returns the largest move, and the reduced matrix for the covariance.
double step(Scene& scene, std::vector<Vector3d>& shifts, Reduced& reduced) {
  const auto size = static_cast<Eigen::Index>(3 * shifts.size());
  const double stiffness = 1 / (prior * prior);
  reduced.matrix = stiffness * Eigen::MatrixXd::Identity(size, size);
  reduced.right.resize(size);
  for (std::size_t v = 0; v < shifts.size(); ++v)
    reduced.right.segment<3>(static_cast<Eigen::Index>(3 * v)) = -stiffness * shifts[v];
  std::vector<PointStep> points(scene.tracks.size());
  for (std::size_t t = 0; t < scene.tracks.size(); ++t) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated) continue;
    PointStep& point = points[t];
    Eigen::Matrix3d normal = 1e-3 * Eigen::Matrix3d::Identity();
    for (const Observation& o : track.observations) {
      if (!scene.view_of(o).registered) continue;
      const auto sight = look(scene, o, track.point + shifts[static_cast<std::size_t>(o.view)]);
      if (!sight) continue;
      const double weight = weight_of(sight->residual);
      const Eigen::Matrix3d square = weight * sight->by_point.transpose() * sight->by_point;
      const Vector3d right = weight * sight->by_point.transpose() * sight->residual;
      normal += square;
      point.right += right;
      reduced.matrix.block<3, 3>(3 * o.view, 3 * o.view) += square;
      reduced.right.segment<3>(3 * o.view) += right;
      point.terms.push_back({o.view, square});
    }
    point.inverse = normal.inverse();
    for (const Term& a : point.terms) {
      const Eigen::Matrix3d half = a.cross * point.inverse;
      reduced.right.segment<3>(3 * a.view) -= half * point.right;
      for (const Term& b : point.terms) reduced.matrix.block<3, 3>(3 * a.view, 3 * b.view) -= half * b.cross;
    }
  }
  const Eigen::VectorXd move = reduced.matrix.ldlt().solve(reduced.right);
  for (std::size_t v = 0; v < shifts.size(); ++v) shifts[v] += move.segment<3>(static_cast<Eigen::Index>(3 * v));
  for (std::size_t t = 0; t < scene.tracks.size(); ++t) {
    PointStep& point = points[t];
    for (const Term& a : point.terms) point.right -= a.cross * move.segment<3>(3 * a.view);
    scene.tracks[t].point += point.inverse * point.right;
  }
  return move.size() == 0 ? 0.0 : move.lpNorm<Eigen::Infinity>();
}

struct Residuals {
  double square_sum = 0;
  int count = 0;

  double rms() const { return count == 0 ? 0.0 : std::sqrt(square_sum / count); }
};

// Residuals in each view of the tracks' observations that agree with the points and shifts, measured without the
// shifts.
std::vector<Residuals> errors_of(const Scene& scene, const std::vector<Vector3d>& shifts) {
  std::vector<Residuals> errors(scene.views.size());
  for (const Track& track : scene.tracks) {
    if (!track.triangulated) continue;
    for (const Observation& o : track.observations) {
      const auto v = static_cast<std::size_t>(o.view);
      if (!scene.view_of(o).registered || reprojection_error(scene, o, track.point + shifts[v]) > agreement) continue;
      const double error = reprojection_error(scene, o, track.point);
      errors[v].square_sum += error * error;
      ++errors[v].count;
    }
  }
  return errors;
}

// Variance of a component of the place that each room-bound camera gives to a point at `place`: the covariance of its
// pose by the room's features, carried to the point; square metres.
std::vector<double> camera_variances(const Scene& room, const std::vector<Residuals>& errors, const Vector3d& place) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  std::vector<Matrix6> information(room.views.size(), Matrix6::Zero());
  const auto by_motion = [](const Vector3d& p) {  // of a point in camera coordinates, by shift and turn of the camera
    Eigen::Matrix<double, 3, 6> motion;
    motion << 1, 0, 0, 0, p.z(), -p.y(), 0, 1, 0, -p.z(), 0, p.x(), 0, 0, 1, p.y(), -p.x(), 0;
    return motion;
  };
  for (const Track& track : room.tracks) {
    if (!track.triangulated) continue;
    for (const Observation& o : track.observations) {
      const Pose& pose = room.view_of(o).cam_from_world;
      const auto sight = room.view_of(o).registered ? look(room, o, track.point) : std::nullopt;
      if (!sight || sight->residual.norm() > agreement) continue;
      const Eigen::Matrix<double, 2, 6> j =
          sight->by_point * pose.rotation.conjugate().toRotationMatrix() * by_motion(pose * track.point);
      information[static_cast<std::size_t>(o.view)] += j.transpose() * j;
    }
  }
  std::vector<double> variances;
  for (std::size_t v = 0; v < room.views.size(); ++v) {
    const Eigen::Matrix<double, 3, 6> motion = by_motion(room.views[v].cam_from_world * place);
    const double pixel_variance = 0.5 * errors[v].rms() * errors[v].rms();
    variances.push_back(
        pixel_variance *
        (motion * information[v].ldlt().solve(Eigen::Matrix<double, 6, 3>(motion.transpose()))).trace() / 3);
  }
  return variances;
}

}  // namespace

std::vector<ViewSway> estimate_sway(const Scene& scene, const Eigen::AlignedBox3d& subject) {
  Scene room = only(scene, Side::room, subject);
  BundleOptions options;
  options.lens = LensFreedom::fixed;
  options.max_points_per_view = room_points_per_view;
  adjust_bundle(room, options);

  Scene body = only(scene, Side::subject, subject);
  for (std::size_t v = 0; v < body.views.size(); ++v) body.views[v].cam_from_world = room.views[v].cam_from_world;
  std::vector<Vector3d> shifts(body.views.size(), Vector3d::Zero());
  const std::vector<Residuals> room_errors = errors_of(room, shifts);
  Reduced reduced;
  for (int round = 0; round < rounds && step(body, shifts, reduced) > 1e-6; ++round) {
  }
  const std::vector<Residuals> body_errors = errors_of(body, shifts);
  double square_sum = 0;  // of what is left, for the unit of the covariance
  int count = 0;
  for (const Track& track : body.tracks) {
    if (!track.triangulated) continue;
    for (const Observation& o : track.observations) {
      const double error = reprojection_error(body, o, track.point + shifts[static_cast<std::size_t>(o.view)]);
      if (error > agreement) continue;
      square_sum += error * error;
      count += 2;
    }
  }
  const Eigen::MatrixXd covariance =
      square_sum / std::max(count, 1) *
      reduced.matrix.ldlt().solve(Eigen::MatrixXd::Identity(reduced.matrix.rows(), reduced.matrix.cols()));
  const std::vector<double> by_camera = camera_variances(room, room_errors, subject.center());
  std::vector<ViewSway> result;
  for (std::size_t v = 0; v < shifts.size(); ++v) {
    if (body_errors[v].count < least_features || room_errors[v].count < least_features) continue;
    const auto at = static_cast<Eigen::Index>(3 * v);
    result.push_back({static_cast<int>(v), shifts[v],
                      std::sqrt(covariance.block<3, 3>(at, at).trace() / 3 + by_camera[v]), body_errors[v].rms(),
                      room_errors[v].rms(), body_errors[v].count, room_errors[v].count});
  }
  return result;
}

double median_sway(std::span<const ViewSway> sway) {
  if (sway.empty()) return 0.0;
  std::vector<double> lengths;
  for (const ViewSway& view : sway) lengths.push_back(view.shift.norm());
  return median(std::move(lengths));
}

nlohmann::json to_json(std::span<const ViewSway> sway, std::span<const std::string> names) {
  nlohmann::json views = nlohmann::json::array();
  for (const ViewSway& view : sway) {
    views.push_back({{"name", names[static_cast<std::size_t>(view.view)]},
                     {"sway_mm", {1000 * view.shift.x(), 1000 * view.shift.y(), 1000 * view.shift.z()}},
                     {"std_mm", 1000 * view.deviation},
                     {"subject_px", view.subject_error},
                     {"background_px", view.background_error},
                     {"subject_features", view.subject_count},
                     {"background_features", view.background_count}});
  }
  return views;
}

}  // namespace gyre
