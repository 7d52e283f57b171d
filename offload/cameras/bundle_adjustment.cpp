// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/bundle_adjustment.h"

#include <ceres/ceres.h>

namespace gyre {

namespace {

constexpr std::size_t pose_size = 7;  // quaternion x y z w, translation
constexpr std::size_t lens_size = 9;  // f, fy / fx, cx, cy, k1, k2, p1, p2, k3

// Prior standard deviations of a lens: shares of the image size for the principal point, absolute for the rest.
constexpr double prior_aspect = 0.005;
constexpr double prior_principal = 0.01;
constexpr double prior_k1 = 0.3;
constexpr double prior_k2 = 0.3;
constexpr double prior_tangential = 0.003;
// Keypoints of one view share errors of the lens model, of the subject and of the detector, so that hundreds say no
// more about the lens than this many independent ones.
constexpr double independent_keypoints_per_view = 50.0;

// Poses change by x -> exp(w) R x + t + v. The reprojection cost writes derivatives by (w, v) directly into the first
// six columns of its block, and PlusJacobian hands them through. One component of the translation may be held, to fix
// the scale of the world.
class PoseManifold final : public ceres::Manifold {
 public:
  explicit PoseManifold(std::optional<int> held = std::nullopt) : held_(held) {}

  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return held_ ? 5 : 6; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    const Eigen::Quaterniond rotation(x);
    Eigen::Map<Eigen::Quaterniond> moved(result);
    moved = (rotation_about(Eigen::Vector3d(delta)) * rotation).normalized();
    const double* shift = delta + 3;
    for (int i = 0; i < 3; ++i) result[4 + i] = x[4 + i] + (held_ == i ? 0.0 : *shift++);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, Eigen::Dynamic, Eigen::RowMajor>> j(jacobian, 7, TangentSize());
    j.setZero();
    for (int i = 0, column = 0; i < 6; ++i)
      if (held_ != i - 3) j(i, column++) = 1.0;
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  std::optional<int> held_;
};

// Reprojection error of one keypoint with analytic derivatives.
class Reprojection final : public ceres::SizedCostFunction<2, 7, 9, 3> {
 public:
  Reprojection(const Eigen::Vector2d& pixel, double weight) : pixel_(pixel), weight_(weight) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> rotation(blocks[0]);
    const Eigen::Map<const Eigen::Vector3d> translation(blocks[0] + 4);
    const double* lens = blocks[1];
    const Eigen::Map<const Eigen::Vector3d> point(blocks[2]);
    const Eigen::Matrix3d R = rotation.toRotationMatrix();
    const Eigen::Vector3d rotated = R * point;
    const Eigen::Vector3d p = rotated + translation;
    const double f = lens[0], aspect = lens[1], k1 = lens[4], k2 = lens[5], p1 = lens[6], p2 = lens[7], k3 = lens[8];
    const double z = std::max(p.z(), 1e-6);  // a point that crosses the image plane gets a huge error, not a NaN
    const double x = p.x() / z, y = p.y() / z;
    const double r2 = x * x + y * y, r4 = r2 * r2;
    const double radial = 1 + k1 * r2 + k2 * r4 + k3 * r4 * r2;
    const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    const double yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    const double fx = weight_ * f, fy = weight_ * f * aspect;
    residuals[0] = fx * xd + weight_ * (lens[2] - pixel_.x());
    residuals[1] = fy * yd + weight_ * (lens[3] - pixel_.y());
    if (jacobians == nullptr) return true;

    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 9, Eigen::RowMajor>> j(jacobians[1]);
      j.row(0) << weight_ * xd, 0, weight_, 0, fx * x * r2, fx * x * r4, fx * 2 * x * y, fx * (r2 + 2 * x * x),
          fx * x * r4 * r2;
      j.row(1) << weight_ * aspect * yd, weight_ * f * yd, 0, weight_, fy * y * r2, fy * y * r4, fy * (r2 + 2 * y * y),
          fy * 2 * x * y, fy * y * r4 * r2;
    }
    if (jacobians[0] == nullptr && jacobians[2] == nullptr) return true;
    const double radial_slope = k1 + 2 * k2 * r2 + 3 * k3 * r4;  // d radial / d r2
    Eigen::Matrix2d distortion;
    distortion << radial + 2 * x * x * radial_slope + 2 * p1 * y + 6 * p2 * x,
        2 * x * y * radial_slope + 2 * p1 * x + 2 * p2 * y, 2 * x * y * radial_slope + 2 * p1 * x + 2 * p2 * y,
        radial + 2 * y * y * radial_slope + 6 * p1 * y + 2 * p2 * x;
    Eigen::Matrix<double, 2, 3> projection;
    projection << 1 / z, 0, -x / z, 0, 1 / z, -y / z;
    const Eigen::Matrix<double, 2, 3> by_camera_point = Eigen::Vector2d(fx, fy).asDiagonal() * distortion * projection;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> j(jacobians[0]);
      j.setZero();
      for (int row = 0; row < 2; ++row) {
        // d (exp(w) q) / dw = -[q]x, so that g . (w x q) = w . (q x g).
        const Eigen::Vector3d g = by_camera_point.row(row);
        j.block<1, 3>(row, 0) = rotated.cross(g).transpose();
        j.block<1, 3>(row, 3) = g.transpose();
      }
    }
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> j(jacobians[2]);
      j = by_camera_point * R;
    }
    return true;
  }

 private:
  Eigen::Vector2d pixel_;
  double weight_;
};

// Pulls a lens that the views leave free towards an ordinary one.
class LensPrior final : public ceres::SizedCostFunction<7, 9> {
 public:
  // strength: what a prior's residual is multiplied with.
  LensPrior(const Camera& camera, double strength) : middle_(0.5 * camera.width, 0.5 * camera.height) {
    const double size = std::max(camera.width, camera.height);
    weight_ << 1 / prior_aspect, 1 / (prior_principal * size), 1 / (prior_principal * size), 1 / prior_k1, 1 / prior_k2,
        1 / prior_tangential, 1 / prior_tangential;
    weight_ *= strength;
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const double* lens = blocks[0];
    const std::array<double, 7> usual{1, middle_.x(), middle_.y(), 0, 0, 0, 0};
    for (int i = 0; i < 7; ++i) residuals[i] = weight_[i] * (lens[i + 1] - usual[static_cast<std::size_t>(i)]);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 7, 9, Eigen::RowMajor>> j(jacobians[0]);
      j.setZero();
      for (int i = 0; i < 7; ++i) j(i, i + 1) = weight_[i];
    }
    return true;
  }

 private:
  Eigen::Vector2d middle_;
  Eigen::Matrix<double, 7, 1> weight_;
};

std::vector<int> constant_lens_entries(LensFreedom freedom) {
  switch (freedom) {
    case LensFreedom::focal:
      return {1, 2, 3, 5, 6, 7, 8};
    case LensFreedom::principal:
      return {6, 7, 8};
    case LensFreedom::tangential:
      return {8};
    case LensFreedom::fixed:
      break;
  }
  return {};
}

// Tracks that take part: all long enough ones that a free view sees, or the longest until every view has its share.
std::vector<int> choose_tracks(const Scene& scene, const BundleOptions& options, const std::vector<bool>& is_free) {
  std::vector<std::pair<int, int>> longest_first;  // minus used count, track
  for (std::size_t t = 0; t < scene.tracks.size(); ++t) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated) continue;
    const int used = track.used_count();
    if (used < options.min_observations) continue;
    const bool touches = std::any_of(track.observations.begin(), track.observations.end(), [&](const Observation& o) {
      return o.used && is_free[static_cast<std::size_t>(o.view)];
    });
    if (touches) longest_first.emplace_back(-used, static_cast<int>(t));
  }
  std::vector<int> chosen;
  if (options.max_points_per_view <= 0) {
    for (const auto& [length, track] : longest_first) chosen.push_back(track);
    return chosen;
  }
  std::sort(longest_first.begin(), longest_first.end());
  std::vector<int> points_of(scene.views.size(), 0);
  for (const auto& [length, t] : longest_first) {
    const Track& track = scene.tracks[static_cast<std::size_t>(t)];
    const bool wanted = std::any_of(track.observations.begin(), track.observations.end(), [&](const Observation& o) {
      return o.used && points_of[static_cast<std::size_t>(o.view)] < options.max_points_per_view;
    });
    if (!wanted) continue;
    for (const Observation& o : track.observations)
      if (o.used) ++points_of[static_cast<std::size_t>(o.view)];
    chosen.push_back(t);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// What fixes the seven degrees of freedom a world has when all of it may move: one pose, and of the view farthest from
// it the component of the translation that grows fastest with the scale.
struct Gauge {
  int fixed_view = -1;
  int scale_view = -1;
  int held_component = 0;
};

Gauge gauge_of(const Scene& scene) {
  Gauge gauge;
  double farthest = 0.0;
  Eigen::Vector3d centre;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    if (!view.registered) continue;
    if (gauge.fixed_view < 0) {
      gauge.fixed_view = static_cast<int>(v);
      centre = centre_of(view.cam_from_world);
      continue;
    }
    const Eigen::Vector3d baseline = centre_of(view.cam_from_world) - centre;
    if (baseline.norm() <= farthest) continue;
    farthest = baseline.norm();
    gauge.scale_view = static_cast<int>(v);
    (view.cam_from_world.rotation * baseline).cwiseAbs().maxCoeff(&gauge.held_component);
  }
  return gauge;
}

}  // namespace

BundleSummary adjust_bundle(Scene& scene, const BundleOptions& options) {
  std::vector<bool> is_free(scene.views.size(), false);
  if (options.free_views.empty()) {
    for (std::size_t v = 0; v < scene.views.size(); ++v) is_free[v] = scene.views[v].registered;
  } else {
    for (const int v : options.free_views) is_free[static_cast<std::size_t>(v)] = true;
  }
  const std::vector<int> tracks = choose_tracks(scene, options, is_free);
  const Gauge gauge = options.free_views.empty() ? gauge_of(scene) : Gauge{};
  if (gauge.fixed_view >= 0) is_free[static_cast<std::size_t>(gauge.fixed_view)] = false;

  // Ceres orders its unknowns by address: one array for all makes the order, and so the rounding, always the same.
  std::vector<double> unknowns(pose_size * scene.views.size() + lens_size * scene.cameras.size());
  const auto pose_of = [&](std::size_t view) { return unknowns.data() + pose_size * view; };
  const auto lens_of = [&](std::size_t camera) {
    return unknowns.data() + pose_size * scene.views.size() + lens_size * camera;
  };
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    Eigen::Map<Eigen::Quaterniond>(pose_of(v)) = scene.views[v].cam_from_world.rotation;
    Eigen::Map<Eigen::Vector3d>(pose_of(v) + 4) = scene.views[v].cam_from_world.translation;
  }
  for (std::size_t k = 0; k < scene.cameras.size(); ++k) {
    const Camera& c = scene.cameras[k];
    const std::array<double, lens_size> lens{c.fx, c.fy / c.fx, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3};
    std::copy(lens.begin(), lens.end(), lens_of(k));
  }

  PoseManifold pose_manifold;
  PoseManifold scale_manifold(gauge.held_component);
  ceres::CauchyLoss loss(options.loss_scale);
  std::unique_ptr<ceres::SubsetManifold> lens_manifold;
  if (options.lens != LensFreedom::fixed)
    lens_manifold = std::make_unique<ceres::SubsetManifold>(9, constant_lens_entries(options.lens));
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<bool> pose_in(scene.views.size(), false);
  std::vector<int> keypoints_of(scene.cameras.size(), 0);
  BundleSummary result;
  for (const int t : tracks) {
    Track& track = scene.tracks[static_cast<std::size_t>(t)];
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const auto view = static_cast<std::size_t>(o.view);
      const auto camera = static_cast<std::size_t>(scene.views[view].camera);
      problem.AddResidualBlock(new Reprojection(scene.pixel_of(o), 1.0), &loss, pose_of(view), lens_of(camera),
                               track.point.data());
      pose_in[view] = true;
      ++keypoints_of[camera];
      ++result.observations;
    }
    if (options.free_points) {
      ordering->AddElementToGroup(track.point.data(), 0);
    } else {
      problem.SetParameterBlockConstant(track.point.data());
    }
  }
  if (result.observations == 0) return result;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (!pose_in[v]) continue;
    if (is_free[v]) {
      problem.SetManifold(pose_of(v), static_cast<int>(v) == gauge.scale_view ? &scale_manifold : &pose_manifold);
      ordering->AddElementToGroup(pose_of(v), 1);
    } else {
      problem.SetParameterBlockConstant(pose_of(v));
    }
  }
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    if (keypoints_of[c] == 0) continue;
    if (lens_manifold) {
      double views = 0;
      for (std::size_t v = 0; v < scene.views.size(); ++v)
        if (pose_in[v] && scene.views[v].camera == static_cast<int>(c)) ++views;
      const double strength = std::sqrt(std::max(1.0, keypoints_of[c] / (independent_keypoints_per_view * views)));
      problem.SetManifold(lens_of(c), lens_manifold.get());
      problem.AddResidualBlock(new LensPrior(scene.cameras[c], strength), nullptr, lens_of(c));
      ordering->AddElementToGroup(lens_of(c), 1);
    } else {
      problem.SetParameterBlockConstant(lens_of(c));
    }
  }

  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;  // a few hundred views: the reduced system is small and nearly full
  solver.linear_solver_ordering = ordering;
  solver.num_threads = 1;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.gradient_tolerance = 1e-12;
  solver.parameter_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.initial_cost = summary.initial_cost;
  result.final_cost = summary.final_cost;
  result.iterations = static_cast<int>(summary.iterations.size());
  if (!summary.IsSolutionUsable()) return result;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (!pose_in[v] || !is_free[v]) continue;
    scene.views[v].cam_from_world.rotation = Eigen::Quaterniond(pose_of(v));
    scene.views[v].cam_from_world.translation = Eigen::Vector3d(pose_of(v) + 4);
  }
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    if (keypoints_of[c] == 0 || !lens_manifold) continue;
    Camera& camera = scene.cameras[c];
    const double* l = lens_of(c);
    camera.fx = l[0];
    camera.fy = l[0] * l[1];
    camera.cx = l[2];
    camera.cy = l[3];
    camera.k1 = l[4];
    camera.k2 = l[5];
    camera.p1 = l[6];
    camera.p2 = l[7];
    camera.k3 = l[8];
  }
  return result;
}

}  // namespace gyre
