// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/face_frame.h"

#include "offload/landmarks/point_grid.h"
#include "offload/landmarks/relief.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace gyre {

namespace {

constexpr double degree = std::numbers::pi / 180.0;

Eigen::Isometry3d frame_at(const Eigen::Vector3d& origin, const Eigen::Vector3d& forward) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  frame.linear().col(0) = up.cross(forward).normalized();
  frame.linear().col(1) = up;
  frame.linear().col(2) = forward;
  frame.translation() = origin;
  return frame;
}

// How much a place stands out as a nose does, metres: it falls off to both sides, below more steeply than above, and
// what lies beside it is the same left and right.
double nose_score(const Relief& relief, const Eigen::Vector2d& at, double scale) {
  const double here = relief.at(at);
  if (!std::isfinite(here)) return -1;
  const auto drop = [&](double x, double y) { return here - relief.at(at + scale * Eigen::Vector2d(x, y)); };
  const double left = 0.5 * (drop(0.018, 0) + drop(0.022, 0.006)),
               right = 0.5 * (drop(-0.018, 0) + drop(-0.022, 0.006));
  const double below = std::max(drop(0, -0.014), drop(0, -0.019));
  const double above = 0.5 * (drop(0, 0.028) + drop(0, 0.036));
  const double bridge_left = drop(0.016, 0.022), bridge_right = drop(-0.016, 0.022);
  if (!std::isfinite(left + right + below + above + bridge_left + bridge_right)) return -1;
  // Full lips leave little of a step below the nose, so that it only speaks for half.
  const double ridge = std::min({left, right, above + 0.001, bridge_left, bridge_right, 0.014});
  const double score = 0.5 * (ridge + std::min(ridge, below + 0.002));
  return score - 0.5 * std::abs(left - right) - 0.25 * std::abs(bridge_left - bridge_right);
}

struct Candidate {
  double score = -1;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();
};

}  // namespace

std::vector<Eigen::Vector3d> head_points(const Figure& figure, const PointCloud& cloud,
                                         const Eigen::Vector3d& towards) {
  constexpr double away = -0.3;  // the underside of nose and chin still counts
  std::vector<Eigen::Vector3d> head;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!cloud.normals.empty() && cloud.normals[i].cast<double>().dot(towards) < away) continue;
    if (figure.level(p) > 0.82 && std::abs(figure.outward(p, 0)) < 0.12 * figure.height &&
        std::abs(figure.depth(p)) < 0.2 * figure.height)
      head.push_back(p);
  }
  return head;
}

std::optional<FaceFrame> find_face(const Figure& figure, const PointCloud& cloud, bool towards_across) {
  const Eigen::Vector3d ahead = towards_across ? figure.across() : Eigen::Vector3d(-figure.across());
  const std::vector<Eigen::Vector3d> head = head_points(figure, cloud, ahead);
  const double scale = std::clamp(figure.height / 1.7, 0.7, 1.1);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (const Eigen::Vector3d& p : head) {
    if (figure.level(p) < 0.88) continue;
    centre += p;
    ++count;
  }
  if (count < 200) return std::nullopt;
  centre /= static_cast<double>(count);
  centre.y() = figure.floor + 0.915 * figure.height;

  Candidate best;
  for (int turn = -40; turn <= 40; turn += 10) {
    const Eigen::Vector3d forward = Eigen::AngleAxisd(turn * degree, Eigen::Vector3d::UnitY()) * ahead;
    ReliefOptions options;
    options.cell = 0.003;
    options.smooth = 0.003;
    options.fill = 0.012;
    options.low = {-0.09, -0.09 * figure.height};
    options.high = {0.09, 0.08 * figure.height};
    std::vector<Eigen::Vector3d> front;
    for (const Eigen::Vector3d& p : head)
      if ((p - centre).dot(forward) > 0) front.push_back(p);
    const Relief relief = make_relief(front, frame_at(centre, forward), options);
    for (int r = 0; r < relief.rows; ++r)
      for (int c = 0; c < relief.columns; ++c) {
        const Eigen::Vector2d at = relief.centre(c, r);
        const double level = 0.915 + at.y() / figure.height;
        if (level < 0.86 || level > 0.965 || std::abs(at.x()) > 0.06) continue;
        constexpr double usual_level = 0.908, spread = 0.02, cost = 0.002;  // of a nose's height, with hair and shoes
        const double unusual = (level - usual_level) / spread;
        const double score = nose_score(relief, at, scale) - cost * unusual * unusual;
        if (score > best.score) best = {score, relief.world_point(at), forward};
      }
  }
  if (best.score <= 0) return std::nullopt;
  FaceFrame frame;
  frame.world_from_face = frame_at(best.place, best.forward);
  frame.score = best.score;
  refine_symmetry(frame, head);
  return frame;
}

void refine_symmetry(FaceFrame& frame, const std::vector<Eigen::Vector3d>& head) {
  const Eigen::Vector3d tip = frame.world_from_face.translation(), up = Eigen::Vector3d::UnitY();
  Eigen::Vector3d mirror = frame.world_from_face.linear().col(0);  // normal of the plane
  const Eigen::Vector3d forward = frame.world_from_face.linear().col(2);
  // What is certainly face: neither hair nor ears nor collar.
  std::vector<Eigen::Vector3d> face;
  for (const Eigen::Vector3d& p : head) {
    const Eigen::Vector3d q = frame.world_from_face.inverse() * p;
    if (std::abs(q.x()) < 0.055 && q.y() > -0.065 && q.y() < 0.05 && q.z() > -0.07 && q.z() < 0.02) face.push_back(p);
  }
  if (face.size() < 200) return;
  const PointGrid grid(face, 0.006);
  // Normals of the points from their neighbours.
  std::vector<Eigen::Vector3d> normals(face.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < face.size(); ++i) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    double count = 0;
    grid.for_within(face[i], 0.007, [&](std::uint32_t j, double) {
      const Eigen::Vector3d d = face[j] - face[i];
      mean += d;
      square += d * d.transpose();
      ++count;
    });
    if (count < 6) continue;
    mean /= count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(square / count - mean * mean.transpose());
    normals[i] = axes.eigenvectors().col(0);
  }
  const std::size_t stride = std::max<std::size_t>(1, face.size() / 3000);
  double offset = mirror.dot(tip);
  for (int iteration = 0; iteration < 25; ++iteration) {
    const double reach = iteration < 8 ? 0.012 : 0.006;
    Eigen::Matrix3d a = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double sum = 0, weights = 0;
    for (std::size_t i = 0; i < face.size(); i += stride) {
      const double beside = mirror.dot(face[i]) - offset;
      const Eigen::Vector3d image = face[i] - 2 * beside * mirror;
      const int j = grid.nearest(image, reach);
      if (j < 0 || normals[j].isZero()) continue;
      const Eigen::Vector3d& n = normals[j];
      const double residual = n.dot(image - face[j]);
      const double weight = 1 / (1 + std::pow(residual / 0.002, 2));
      // The plane's normal turned by (p, q) about up and forward, and its offset moved by r: d image.
      const Eigen::Vector3d moved(-2 * n.dot(forward.dot(face[i] - tip) * mirror + beside * forward),
                                  -2 * n.dot(up.dot(face[i] - tip) * mirror + beside * up), 2 * n.dot(mirror));
      a += weight * moved * moved.transpose();
      b -= weight * residual * moved;
      sum += weight * residual * residual;
      weights += weight;
    }
    if (weights < 50) return;
    const Eigen::Vector3d step = a.ldlt().solve(b);
    // The offset is that of the plane at the tip.
    const double at_tip = offset - mirror.dot(tip) + step[2];
    mirror = (mirror + step[0] * forward + step[1] * up).normalized();
    offset = mirror.dot(tip) + at_tip;
    frame.asymmetry = std::sqrt(sum / weights);
    if (step.norm() < 1e-6) break;
  }
  Eigen::Isometry3d refined = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d out = mirror.cross(up).normalized();
  refined.linear().col(0) = mirror;
  refined.linear().col(2) = out;
  refined.linear().col(1) = out.cross(mirror);
  refined.translation() = tip + (offset - mirror.dot(tip)) * mirror;
  // A plane that has run away says that there was no symmetry to find.
  if (refined.linear().col(0).dot(frame.world_from_face.linear().col(0)) < std::cos(25 * degree)) return;
  if ((refined.translation() - tip).norm() > 0.012) return;
  frame.world_from_face = refined;
}

}  // namespace gyre
