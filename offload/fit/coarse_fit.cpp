// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/coarse_fit.h"

#include "common/geometry/pose.h"
#include "common/parallel/parallel.h"
#include "offload/body/body_jacobian.h"
#include "offload/fit/cloud_preparation.h"
#include "offload/fit/pose_prior.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

namespace gyre {

namespace {

constexpr std::size_t block = 128;  // matches whose equations are summed together; fixes the order of the sums

struct NormalEquations {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;

  explicit NormalEquations(int parameters)
      : hessian(Eigen::MatrixXd::Zero(parameters, parameters)), gradient(Eigen::VectorXd::Zero(parameters)) {}
};

// Sums w |A (x + J d - target)|^2 over the matches, A with weight 1 along the normal and slide_weight across it.
NormalEquations data_equations(const BodyJacobian& jacobian, const PosedBody& posed, const std::vector<Match>& matches,
                               double slide_weight, int threads) {
  const int parameters = jacobian.parameters();
  const std::size_t blocks = (matches.size() + block - 1) / block;
  constexpr std::size_t batch = 8;  // blocks held at once, for memory
  NormalEquations sum(parameters);
  for (std::size_t first = 0; first < blocks; first += batch) {
    const std::size_t count = std::min(batch, blocks - first);
    std::vector<NormalEquations> parts(count, NormalEquations(parameters));
    parallel_for(count, threads, [&](std::size_t b) {
      const std::size_t begin = (first + b) * block, end = std::min(matches.size(), begin + block);
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * (end - begin)), parameters);
      Eigen::VectorXd residuals(rows.rows());
      Eigen::Matrix3Xd at_point(3, parameters);
      for (std::size_t i = begin; i < end; ++i) {
        const Match& m = matches[i];
        at_point.setZero();
        Eigen::Vector3d x = Eigen::Vector3d::Zero();
        for (int k = 0; k < 3; ++k) {
          if (m.weights[k] == 0.0) continue;
          jacobian.add_vertex(m.corners[k], m.weights[k], at_point);
          x += m.weights[k] * posed.vertices[m.corners[k]];
        }
        const Eigen::Matrix3d normal_part = m.normal * m.normal.transpose();
        const Eigen::Matrix3d whitening =
            std::sqrt(m.weight) * (normal_part + std::sqrt(slide_weight) * (Eigen::Matrix3d::Identity() - normal_part));
        const auto row = static_cast<Eigen::Index>(3 * (i - begin));
        rows.middleRows<3>(row) = whitening * at_point;
        residuals.segment<3>(row) = whitening * (x - m.target);
      }
      parts[b].hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
      parts[b].gradient = rows.transpose() * residuals;
    });
    for (const NormalEquations& part : parts) {
      sum.hessian += part.hessian;
      sum.gradient += part.gradient;
    }
  }
  sum.hessian = sum.hessian.selfadjointView<Eigen::Lower>();
  return sum;
}

// One outer vertex for each cell of the mean shape.
std::vector<int> thinned_vertices(const BodyTemplate& body, const OuterSurface& outer, double cell) {
  std::set<std::array<int, 3>> taken;
  std::vector<int> kept;
  for (const int v : outer.vertices) {
    const Eigen::Vector3d p = body.mesh.vertices[v] / cell;
    if (taken
            .insert({static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())),
                     static_cast<int>(std::floor(p.z()))})
            .second)
      kept.push_back(v);
  }
  return kept;
}

// Geman-McClure weights of width `width`.
void weigh(std::vector<Match>& matches, const BodyTemplate& body, const PosedBody& posed, double width,
           const CoarseFitOptions& options) {
  for (Match& m : matches) {
    const bool hair = body.regions[m.corners[0]] == BodyRegion::head;
    const double ratio = width * width / (width * width + (place_of(m, posed.vertices) - m.target).squaredNorm());
    m.weight *= ratio * ratio * (m.offset <= 0 ? 1.0 : hair ? options.hair_weight : options.clothes_weight);
  }
}

// Squared Mahalanobis distances of the landmarks, each with a Geman-McClure weight of `width` standard deviations.
void add_landmarks(const std::vector<LandmarkTarget>& landmarks, const BodyJacobian& jacobian, const PosedBody& posed,
                   double width, NormalEquations& equations) {
  Eigen::Matrix3Xd at_point(3, jacobian.parameters());
  for (const LandmarkTarget& l : landmarks) {
    at_point.setZero();
    jacobian.add_vertex(l.vertex, 1.0, at_point);
    const Eigen::Vector3d residual = posed.vertices[l.vertex] - l.position;
    const double ratio = width * width / (width * width + residual.dot(l.information * residual));
    const Eigen::MatrixX3d weighted = ratio * ratio * at_point.transpose() * l.information;
    equations.hessian += weighted * at_point;
    equations.gradient += weighted * residual;
  }
}

// Whether the landmarks hold most of a body and not only a face or a hand.
bool span_body(const std::vector<LandmarkTarget>& landmarks) {
  constexpr double span = 0.6;  // metres
  Eigen::AlignedBox3d box;
  for (const LandmarkTarget& l : landmarks) box.extend(l.position);
  return landmarks.size() >= 6 && box.diagonal().norm() > span;
}

// The state moved, turned and scaled so that its landmarks lie best on theirs (closed form).
BodyState moved_to_landmarks(const BodyTemplate& body, const std::vector<LandmarkTarget>& landmarks,
                             const BodyState& state) {
  const PosedBody posed = evaluate(body, state);
  std::vector<Eigen::Vector3d> from, to;
  for (const LandmarkTarget& l : landmarks) {
    from.push_back(posed.vertices[l.vertex]);
    to.push_back(l.position);
  }
  const auto motion = align_points(to, from);
  if (!motion || !(motion->scale > 0)) return state;
  BodyState moved = state;
  moved.scale *= motion->scale;
  moved.pose.rotations[0] =
      rotation_vector_of(motion->rotation.toRotationMatrix() * rotation_of(state.pose.rotations[0]));
  // The root joint is where everything turns and where the scale moves it to.
  const Eigen::Vector3d& root = posed.rest_joints[0];
  moved.pose.translation = *motion * (root + state.pose.translation) - motion->scale * root;
  return moved;
}

double misfit_of(const std::vector<Match>& matches, const PosedBody& posed, std::size_t asked, double radius) {
  double sum = static_cast<double>(asked - matches.size()) * radius;
  for (const Match& m : matches) sum += std::min((place_of(m, posed.vertices) - m.target).norm(), radius);
  return asked > 0 ? sum / static_cast<double>(asked) : radius;
}

// Steps beyond this are a sign of few matches, not of a body that moved.
void limit_step(Eigen::VectorXd& step, const BodyJacobian& jacobian) {
  const auto shrink = [&](auto part, double largest) {
    if (const double size = part.norm(); size > largest) part *= largest / size;
  };
  shrink(step.head<3>(), 0.1);
  step[3] = std::clamp(step[3], -0.05, 0.05);
  for (std::size_t k = 0; k < jacobian.free_joints().size(); ++k)
    shrink(step.segment<3>(jacobian.joint_column(static_cast<int>(k))), 0.25);
  for (Eigen::Index s = jacobian.shape_column(); s < step.size(); ++s) step[s] = std::clamp(step[s], -1.0, 1.0);
}

}  // namespace

CoarseFit fit_coarse(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                     const std::vector<LandmarkTarget>& landmarks, const BodyState& start,
                     const CoarseFitOptions& options, const Progress& progress) {
  const OrientedPoints points = thin(cloud, cell_for_count(cloud, options.cloud_points));
  const PointIndex cloud_index(points);
  const std::vector<int> vertices = thinned_vertices(body, outer, options.surface_cell);
  const bool held = span_body(landmarks);
  CoarseFit fit{held ? moved_to_landmarks(body, landmarks, start) : start};
  const PosePrior prior = standing_prior(body, fit.state.pose);
  const int shapes = static_cast<int>(body.shapes.size());
  BodyJacobian jacobian(body, prior.joints, shapes);

  // Adds the priors and takes the step; false when there is none.
  const auto solve = [&](NormalEquations& equations, double shape_weight) {
    add_prior(prior, fit.state.pose, jacobian.joint_column(0), 0.03, equations.hessian, equations.gradient);
    const double scale_weight = 1.0 / (options.scale_deviation * options.scale_deviation);
    equations.hessian(3, 3) += scale_weight;
    equations.gradient[3] += scale_weight * std::log(fit.state.scale / options.mean_scale);
    for (int s = 0; s < shapes; ++s) {
      equations.hessian(jacobian.shape_column() + s, jacobian.shape_column() + s) += shape_weight;
      equations.gradient[jacobian.shape_column() + s] += shape_weight * fit.state.shape[s];
    }
    equations.hessian.diagonal() *= 1.0 + 1e-4;
    equations.hessian.diagonal().array() += 1e-9;
    Eigen::VectorXd step = equations.hessian.ldlt().solve(-equations.gradient);
    if (!step.allFinite()) return false;
    limit_step(step, jacobian);
    fit.state = jacobian.stepped(fit.state, step);
    return true;
  };

  const int first = held ? options.landmark_iterations : 0;
  // What landmarks hold is near already; a wider search would find the trunk for a missing arm.
  const double first_radius = held ? 0.4 * options.first_radius : options.first_radius;
  constexpr double firm = 100.0;  // weight of the shape's prior while the pose is still far off
  for (int i = 0; i < first; ++i) {
    const PosedBody posed = evaluate(body, fit.state);
    jacobian.linearise(fit.state, posed);
    NormalEquations equations(jacobian.parameters());
    // Wide at first: nothing is an outlier before the body is there.
    add_landmarks(landmarks, jacobian, posed, 30.0 * std::pow(0.2, static_cast<double>(i) / first), equations);
    if (!solve(equations, firm)) break;
  }

  const auto matches_of = [&](const PosedBody& posed, const MatchGate& gate, std::vector<Match>& to_surface,
                              std::vector<Match>& to_cloud) {
    const SearchableSurface surface(outer, posed.vertices, posed.normals);
    to_surface = match_cloud(points, surface, gate, options.threads);
    to_cloud = match_vertices(vertices, surface, cloud_index, gate, gate.radius, options.threads);
  };
  std::vector<Match> to_surface, to_cloud;
  for (int i = 0; i < options.iterations; ++i) {
    const double progressed = static_cast<double>(i) / options.iterations;
    if (progress) progress(progressed, "fitting pose and shape");
    // The first third settles the pose with everything in reach, the second brings the shape in, the last refines.
    const double radius =
        std::max(options.last_radius, first_radius * std::pow(options.last_radius / first_radius, progressed / 0.7));
    const MatchGate gate{radius, progressed < 0.2 ? 0.0 : options.min_cosine, 8};
    const PosedBody posed = evaluate(body, fit.state);
    matches_of(posed, gate, to_surface, to_cloud);
    weigh(to_surface, body, posed, 0.4 * radius, options);
    weigh(to_cloud, body, posed, 0.4 * radius, options);
    std::vector<Match> matches = to_surface;
    matches.insert(matches.end(), to_cloud.begin(), to_cloud.end());
    double total = 0.0;
    for (const Match& m : matches) total += m.weight;
    if (!(total > 0) && landmarks.empty()) break;

    jacobian.linearise(fit.state, posed);
    NormalEquations equations = data_equations(jacobian, posed, matches, options.slide_weight, options.threads);
    const double unit =
        total > 0 ? options.data_count / (total * options.data_deviation * options.data_deviation) : 0.0;
    equations.hessian *= unit;
    equations.gradient *= unit;
    add_landmarks(landmarks, jacobian, posed, 5.0, equations);
    if (!solve(equations, progressed < 0.33 ? firm : 1.0)) break;
  }

  const PosedBody posed = evaluate(body, fit.state);
  matches_of(posed, {options.last_radius, options.min_cosine, 8}, to_surface, to_cloud);
  fit.misfit = 0.5 * (misfit_of(to_surface, posed, points.size(), options.last_radius) +
                      misfit_of(to_cloud, posed, vertices.size(), options.last_radius));
  return fit;
}

}  // namespace gyre
