// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/head_alignment.h"

#include "common/geometry/pose.h"
#include "offload/body/body_jacobian.h"
#include "offload/fit/cloud_preparation.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace gyre {

namespace {

bool of_head(BodyRegion region) {
  return region == BodyRegion::head || region == BodyRegion::face;
}

// The head's parameters: 3 shift, 3 rotation, 1 logarithm of the scale, then its shapes.
class HeadModel {
 public:
  HeadModel(const BodyTemplate& body, const BodyState& state)
      : body_(body),
        shares_(head_shares(body)),
        joint_(body.joint_index("head")),
        jacobian_(body, {}, 0, static_cast<int>(body.head_shapes.size())),
        state_(state) {
    state_.head.conservativeResizeLike(Eigen::VectorXd::Zero(jacobian_.head_count()));
    update();
  }

  int parameters() const { return 7 + jacobian_.head_count(); }
  double share(int v) const { return shares_[v]; }  // of the head in the vertex's motion
  const BodyState& state() const { return state_; }
  const Similarity& motion() const { return motion_; }
  const std::vector<Eigen::Vector3d>& vertices() const { return vertices_; }

  // columns (3 x parameters) += weight * d vertex / d parameters.
  void add_vertex(int v, double weight, Eigen::Ref<Eigen::Matrix3Xd> columns) const {
    const Eigen::Vector3d arm = motion_ * (posed_.vertices[v] - centre_) - motion_.translation;
    columns.leftCols<3>() += weight * shares_[v] * Eigen::Matrix3d::Identity();
    columns.middleCols<3>(3) -= weight * shares_[v] * cross_matrix(arm);
    columns.col(6) += weight * shares_[v] * arm;
    if (jacobian_.head_count() == 0) return;
    Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, jacobian_.parameters());
    jacobian_.add_vertex(v, weight, all);
    const Eigen::Matrix3d turn = (1.0 - shares_[v]) * Eigen::Matrix3d::Identity() +
                                 shares_[v] * motion_.scale * motion_.rotation.toRotationMatrix();
    columns.rightCols(jacobian_.head_count()) += turn * all.rightCols(jacobian_.head_count());
  }

  void take(const Eigen::VectorXd& step) {
    motion_.translation += step.head<3>();
    motion_.rotation = rotation_about(step.segment<3>(3)) * motion_.rotation;
    motion_.scale *= std::exp(step[6]);
    state_.head += step.tail(jacobian_.head_count());
    update();
  }

  // The state with the head's turn handed to its joint.
  BodyState turned_state() const {
    BodyState turned = state_;
    const int parent = body_.joints[joint_].parent;
    const Eigen::Matrix3d above =
        parent < 0 ? Eigen::Matrix3d::Identity() : Eigen::Matrix3d(posed_.posed_from_rest[parent].linear());
    Eigen::Vector3d& rotation = turned.pose.rotations[joint_];
    rotation =
        rotation_vector_of(above.transpose() * motion_.rotation.toRotationMatrix() * above * rotation_of(rotation));
    return turned;
  }

 private:
  void update() {
    posed_ = evaluate(body_, state_);
    centre_ = posed_.joint(joint_);
    jacobian_.linearise(state_, posed_);
    vertices_ = posed_.vertices;
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      if (shares_[v] > 0) vertices_[v] += shares_[v] * (centre_ + motion_ * (vertices_[v] - centre_) - vertices_[v]);
  }

  const BodyTemplate& body_;
  std::vector<double> shares_;
  int joint_;
  BodyJacobian jacobian_;
  BodyState state_;
  Similarity motion_;  // about the head joint
  PosedBody posed_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> vertices_;
};

struct Equations {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  double total = 0.0;

  explicit Equations(int parameters)
      : hessian(Eigen::MatrixXd::Zero(parameters, parameters)), gradient(Eigen::VectorXd::Zero(parameters)) {}

  void add(const Eigen::Matrix3Xd& columns, const Eigen::Matrix3d& information, const Eigen::Vector3d& residual) {
    const Eigen::MatrixX3d weighted = columns.transpose() * information;
    hessian.noalias() += weighted * columns;
    gradient += weighted * residual;
  }
};

// Per template vertex: how surely it is bare skin. Hair, beards and collars come from the edges of the face.
std::vector<double> bareness(const BodyTemplate& body) {
  std::vector<double> bare(body.mesh.vertices.size(), 1.0);
  const auto nose = body.landmarks.find("noseTip");
  if (nose == body.landmarks.end()) return bare;
  constexpr double middle = 0.05, most = 8.0;  // metres; weight at the nose
  for (std::size_t v = 0; v < bare.size(); ++v) {
    const double squared = (body.mesh.vertices[v] - body.mesh.vertices[nose->second]).squaredNorm();
    bare[v] = 1.0 + (most - 1.0) * std::exp(-squared / (middle * middle));
  }
  return bare;
}

// Adds the matches' equations.
void add_matches(const std::vector<Match>& matches, const BodyTemplate& body, const std::vector<double>& bare,
                 const HeadModel& head, double width, const HeadAlignmentOptions& options, Equations& equations) {
  Eigen::Matrix3Xd columns(3, head.parameters());
  for (const Match& m : matches) {
    if (head.share(m.corners[0]) + head.share(m.corners[1]) + head.share(m.corners[2]) == 0.0) continue;
    columns.setZero();
    Eigen::Vector3d residual = -m.target;
    for (int k = 0; k < 3; ++k) {
      if (m.weights[k] == 0.0) continue;
      head.add_vertex(m.corners[k], m.weights[k], columns);
      residual += m.weights[k] * head.vertices()[m.corners[k]];
    }
    const double ratio = width * width / (width * width + residual.squaredNorm());
    const bool hair = m.offset > 0 && body.regions[m.corners[0]] == BodyRegion::head;
    const double weight = m.weight * ratio * ratio * (hair ? options.hair_weight : bare[m.corners[0]]);
    const Eigen::Matrix3d normal_part = m.normal * m.normal.transpose();
    equations.add(columns, weight * (normal_part + options.slide_weight * (Eigen::Matrix3d::Identity() - normal_part)),
                  residual);
    equations.total += weight;
  }
}

struct Problem {
  const BodyTemplate& body;
  const OuterSurface& outer;
  const OuterSurface& head_surface;
  OrientedPoints points;  // around the head
  std::vector<LandmarkTarget> landmarks;
  std::vector<double> bare;
  const HeadAlignmentOptions& options;
};

// Adds landmarks and priors.
void add_knowledge(const Problem& problem, const HeadModel& head, Equations& equations) {
  const HeadAlignmentOptions& options = problem.options;
  Eigen::Matrix3Xd columns(3, head.parameters());
  for (const LandmarkTarget& l : problem.landmarks) {
    columns.setZero();
    head.add_vertex(l.vertex, 1.0, columns);
    const Eigen::Vector3d residual = head.vertices()[l.vertex] - l.position;
    constexpr double width = 5.0;  // standard deviations
    const double ratio = width * width / (width * width + residual.dot(l.information * residual));
    equations.add(columns, ratio * ratio * l.information, residual);
  }
  const auto hold = [&](int at, double value, double deviation) {
    equations.hessian(at, at) += 1.0 / (deviation * deviation);
    equations.gradient[at] += value / (deviation * deviation);
  };
  const Eigen::Vector3d turned = rotation_vector_of(head.motion().rotation.toRotationMatrix());
  for (int k = 0; k < 3; ++k) {
    hold(k, head.motion().translation[k], options.shift_deviation);
    hold(3 + k, turned[k], options.rotation_deviation);
  }
  hold(6, std::log(head.motion().scale), options.scale_deviation);
  for (int s = 0; s < head.state().head.size(); ++s) hold(7 + s, head.state().head[s], 1.0);
}

// Mean robust distance of the bare skin to the cloud, in [0, 1], and of the landmarks.
double cost_of(const Problem& problem, const HeadModel& head, const std::vector<Match>& to_cloud) {
  const double width = problem.options.last_radius;
  double sum = 0.0, all = 0.0;
  for (const int v : problem.head_surface.vertices)
    if (problem.body.regions[v] == BodyRegion::face) all += problem.bare[v];
  sum = all;  // what has no counterpart costs most
  for (const Match& m : to_cloud) {
    const int v = m.corners[0];
    if (problem.body.regions[v] != BodyRegion::face) continue;
    const double squared = (head.vertices()[v] - m.target).squaredNorm();
    sum -= problem.bare[v] * width * width / (width * width + squared);
  }
  double cost = all > 0 ? sum / all : 0.0;
  constexpr double far = 25.0;  // squared standard deviations
  for (const LandmarkTarget& l : problem.landmarks) {
    const Eigen::Vector3d residual = head.vertices()[l.vertex] - l.position;
    const double squared = residual.dot(l.information * residual);
    cost += squared / (squared + far) / static_cast<double>(problem.landmarks.size());
  }
  return cost;
}

// Gauss-Newton from where the head is; the cost where it ends.
double descend(const Problem& problem, HeadModel& head) {
  const HeadAlignmentOptions& options = problem.options;
  std::optional<PointIndex> index;
  if (problem.points.size() > 0) index.emplace(problem.points);
  std::vector<Match> to_cloud;
  for (int i = 0; i < options.iterations; ++i) {
    const double done = static_cast<double>(i) / options.iterations;
    const double radius = std::max(
        options.last_radius, options.first_radius * std::pow(options.last_radius / options.first_radius, done / 0.7));
    Equations equations(head.parameters());
    if (index) {
      const std::vector<Eigen::Vector3d> normals = vertex_normals(head.vertices(), problem.body.mesh.triangles);
      // Points of the shoulders find the shoulders.
      const SearchableSurface surface(problem.outer, head.vertices(), normals);
      const MatchGate gate{radius, options.min_cosine, 8};
      to_cloud = match_vertices(problem.head_surface.vertices, surface, *index, gate, gate.radius, options.threads);
      add_matches(match_cloud(problem.points, surface, gate, options.threads), problem.body, problem.bare, head,
                  0.4 * radius, options, equations);
      add_matches(to_cloud, problem.body, problem.bare, head, 0.4 * radius, options, equations);
      if (equations.total > 0) {
        const double unit = options.data_count / (equations.total * options.data_deviation * options.data_deviation);
        equations.hessian *= unit;
        equations.gradient *= unit;
      }
    }
    add_knowledge(problem, head, equations);
    const Eigen::VectorXd step = equations.hessian.ldlt().solve(-equations.gradient);
    if (!step.allFinite()) break;
    head.take(step);
  }
  return cost_of(problem, head, to_cloud);
}

}  // namespace

OrientedPoints points_near(const OrientedPoints& cloud, const OuterSurface& head,
                           const std::vector<Eigen::Vector3d>& vertices, double reach) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const int v : head.vertices) {
    low = low.cwiseMin(vertices[v]);
    high = high.cwiseMax(vertices[v]);
  }
  low.array() -= reach;
  high.array() += reach;
  OrientedPoints points;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d& p = cloud.positions[i];
    if ((p - low).minCoeff() < 0 || (high - p).minCoeff() < 0) continue;
    points.positions.push_back(p);
    points.normals.push_back(cloud.normals[i]);
    points.weights.push_back(cloud.weight(i));
  }
  return points;
}

std::vector<double> head_shares(const BodyTemplate& body) {
  const int head = body.joint_index("head");
  std::vector<bool> below(body.joints.size(), false);
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    const int parent = body.joints[j].parent;
    below[j] = static_cast<int>(j) == head || (parent >= 0 && below[parent]);
  }
  std::vector<double> shares(body.skin.size(), 0.0);
  for (std::size_t v = 0; v < shares.size(); ++v)
    for (std::size_t k = 0; k < body.skin[v].joint.size(); ++k)
      if (below[body.skin[v].joint[k]]) shares[v] += body.skin[v].weight[k];
  return shares;
}

HeadAlignment align_head(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<LandmarkTarget>& landmarks, const BodyState& state,
                         const HeadAlignmentOptions& options) {
  HeadAlignment alignment{state, evaluate(body, state).vertices};
  const OuterSurface head_surface = part_of_surface(outer, [&](int v) { return of_head(body.regions[v]); });
  if (body.joint_index("head") < 0 || head_surface.triangles.empty()) return alignment;
  Problem problem{
      body, outer,          head_surface, points_near(cloud, head_surface, alignment.vertices, options.first_radius),
      {},   bareness(body), options};
  for (const LandmarkTarget& l : landmarks)
    if (on_head(l.name)) problem.landmarks.push_back(l);
  if (problem.points.size() == 0 && problem.landmarks.empty()) return alignment;
  if (problem.points.size() > 0)
    problem.points = thin(problem.points, cell_for_count(problem.points, options.cloud_points));

  // A face looks much like itself a little higher or lower, to closest points: the start decides where they end.
  double least = std::numeric_limits<double>::infinity();
  for (const double rise : {0.0, -0.02, 0.02}) {
    HeadModel head(body, state);
    Eigen::VectorXd lift = Eigen::VectorXd::Zero(head.parameters());
    lift[1] = rise;
    head.take(lift);
    const double cost = descend(problem, head);
    if (cost >= least) continue;
    least = cost;
    alignment = {head.turned_state(), head.vertices(), head.motion().scale};
  }
  return alignment;
}

}  // namespace gyre
