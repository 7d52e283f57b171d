// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/body_landmarks.h"

#include "offload/landmarks/point_grid.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Standard deviation `along` in the unit direction, `across` in every other.
Matrix3d covariance(const Vector3d& direction, double along, double across) {
  return across * across * Matrix3d::Identity() + (along * along - across * across) * direction * direction.transpose();
}

class BodyFinder {
 public:
  BodyFinder(const Subject& subject, Detections& found)
      : cloud_(subject.cloud),
        figure_(subject.figure),
        parts_(subject.parts),
        facing_(subject.facing),
        found_(found),
        points_(all(subject)),
        grid_(points_, 0.01) {}

  void find() {
    find_crown();
    find_fork();
    for (int side = 0; side < 2; ++side) {
      if (!facing_.towards_across) {
        for (const char* part : {"Shoulder", "Elbow", "Wrist", "Fingertip", "Knee", "Ankle", "Heel", "Toe"})
          miss((side == 0 ? std::string("left") : std::string("right")) + part,
               "which side is the left one is not decided");
        continue;
      }
      prefix_ = side == facing_.left() ? "left" : "right";
      side_ = side;
      find_shoulder();
      find_arm();
      find_leg();
      find_foot();
    }
  }

 private:
  static std::vector<Vector3d> all(const Subject& subject) {
    std::vector<Vector3d> points;
    points.reserve(subject.cloud.points.size());
    for (const Eigen::Vector3f& p : subject.cloud.points) points.push_back(p.cast<double>());
    return points;
  }

  Vector3d forward() const { return *facing_.towards_across ? figure_.across() : Vector3d(-figure_.across()); }
  Vector3d outside() const { return (side_ == 0 ? 1.0 : -1.0) * figure_.lateral; }

  void place(const std::string& name, const Vector3d& position, const Matrix3d& spread) {
    found_.placed.push_back({name, position, spread, "geometric", {}});
  }
  void miss(const std::string& name, const std::string& reason) { found_.missing[name] = reason; }

  // The outermost of some nodes along a direction: mean of the three outermost, if the surface there looks that way.
  std::optional<Vector3d> outermost(const std::vector<int>& nodes, const Vector3d& direction) const {
    std::vector<std::pair<double, int>> order;
    for (const int i : nodes) order.emplace_back(figure_.graph.nodes[i].dot(direction), i);
    if (order.size() < 3) return std::nullopt;
    std::partial_sort(order.begin(), order.begin() + 3, order.end(), std::greater<>());
    Vector3d sum = Vector3d::Zero(), normal = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      sum += figure_.graph.nodes[order[k].second] / 3;
      normal += figure_.graph.normals[order[k].second] / 3;
    }
    if (normal.dot(direction) < 0.2) return std::nullopt;
    return sum;
  }

  // Moves an end to where the cloud itself ends: the mean of the outermost twentieth of the points around it.
  Vector3d refined_end(const Vector3d& end, const Vector3d& direction, double radius) const {
    std::vector<std::pair<double, std::uint32_t>> reach;
    grid_.for_within(end, radius,
                     [&](std::uint32_t i, double) { reach.emplace_back((points_[i] - end).dot(direction), i); });
    if (reach.size() < 20) return end;
    std::sort(reach.begin(), reach.end(), std::greater<>());
    const std::size_t count = std::max<std::size_t>(4, reach.size() / 20);
    Vector3d sum = Vector3d::Zero();
    for (std::size_t k = 0; k < count; ++k) sum += points_[reach[k].second] / static_cast<double>(count);
    return sum;
  }

  void find_crown() {
    std::vector<int> top;
    for (std::size_t i = 0; i < figure_.graph.size(); ++i) {
      const Vector3d& p = figure_.graph.nodes[i];
      if (figure_.level(p) > 0.93 && std::abs(figure_.outward(p, 0)) < 0.08 * figure_.height)
        top.push_back(static_cast<int>(i));
    }
    const auto crown = outermost(top, Vector3d::UnitY());
    if (!crown) return miss("crown", "the cloud has no top of the head");
    place("crown", refined_end(*crown, Vector3d::UnitY(), 0.015), covariance(Vector3d::UnitY(), 0.006, 0.02));
  }

  void find_fork() {
    const auto crotch = find_crotch(figure_, cloud_);
    if (!crotch) return miss("crotch", "the legs do not part where a crotch could be: clothes hide it");
    place("crotch", *crotch, covariance(Vector3d::UnitY(), 0.015, 0.018));
  }

  // The upper edge of the shoulder over the joint; how far out that is, only proportions tell.
  void find_shoulder() {
    const double out = 0.095 * figure_.height;
    std::vector<int> ridge;
    for (std::size_t i = 0; i < figure_.graph.size(); ++i) {
      const Vector3d& p = figure_.graph.nodes[i];
      if (figure_.level(p) > 0.74 && figure_.level(p) < 0.88 && std::abs(figure_.outward(p, side_) - out) < 0.009 &&
          std::abs(figure_.depth(p)) < 0.10 * figure_.height)
        ridge.push_back(static_cast<int>(i));
    }
    const auto shoulder = outermost(ridge, Vector3d::UnitY());
    if (!shoulder) return miss(prefix_ + "Shoulder", "the cloud has a hole on top of the shoulder");
    Matrix3d spread = covariance(outside(), 0.016 * figure_.height, 0.012);
    place(prefix_ + "Shoulder", *shoulder, spread);
  }

  std::vector<int> nodes_around(const Arm& arm, double along) const {
    std::vector<int> nodes;
    for (const LimbSection& section : arm.sections)
      if (std::abs(section.along - along) < 0.011 * figure_.height)
        nodes.insert(nodes.end(), section.nodes.begin(), section.nodes.end());
    return nodes;
  }

  void find_arm() {
    const auto& arm = parts_.arms[side_];
    if (!arm) {
      for (const char* part : {"Elbow", "Wrist", "Fingertip"}) miss(prefix_ + part, parts_.arm_reasons[side_]);
      return;
    }
    const Vector3d tip_direction = -direction_at(*arm, 0.02);
    place(prefix_ + "Fingertip", refined_end(arm->fingertip, tip_direction, 0.012),
          covariance(tip_direction, 0.006, 0.009));
    const auto on_arm = [&](const char* part, const std::optional<Along>& along, const Vector3d& towards) {
      if (!along) return miss(prefix_ + part, "too little of the arm is in the cloud");
      const Vector3d axis = direction_at(*arm, along->distance);
      const Vector3d direction = (towards - towards.dot(axis) * axis).normalized();
      const auto place_on = outermost(nodes_around(*arm, along->distance), direction);
      if (!place_on) return miss(prefix_ + part, "the cloud has a hole on that side of the arm");
      // The tip's own place on the section is of no importance, only the side.
      const Vector3d centre = centre_at(*arm, along->distance);
      const Vector3d position = centre + direction * (*place_on - centre).dot(direction);
      place(prefix_ + part, position, covariance(axis, std::max(along->deviation, 0.008), 0.008));
    };
    on_arm("Wrist", find_wrist(*arm, figure_.height), outside());
    on_arm("Elbow", find_elbow(*arm, figure_.height), -forward());
  }

  void find_leg() {
    const double level = 0.274;
    const std::vector<int> nodes = leg_nodes(figure_, side_, level - 0.008, level + 0.008);
    const auto knee = nodes.size() < 12 ? std::nullopt : outermost(nodes, forward());
    if (!knee) return miss(prefix_ + "Knee", "the cloud has no leg there");
    place(prefix_ + "Knee", *knee, covariance(Vector3d::UnitY(), 0.018 * figure_.height, 0.012));
  }

  void find_foot() {
    const auto& foot = parts_.feet[side_];
    if (!foot) {
      for (const char* part : {"Heel", "Toe", "Ankle"})
        miss(prefix_ + part, "the cloud has no whole foot on this side");
      return;
    }
    const Vector3d ahead = foot->axis.dot(forward()) > 0 ? foot->axis : Vector3d(-foot->axis);
    const auto low_nodes = [&](double high_level) {
      std::vector<int> nodes;
      for (const int i : foot->nodes)
        if (figure_.level(figure_.graph.nodes[i]) < high_level) nodes.push_back(i);
      return nodes;
    };
    const auto heel = outermost(low_nodes(0.035), -ahead), toe = outermost(low_nodes(0.035), ahead);
    const Vector3d sideways = ahead.cross(Vector3d::UnitY());
    if (heel) {
      place(prefix_ + "Heel", refined_end(*heel, -ahead, 0.012), covariance(ahead, 0.006, 0.010));
    } else {
      miss(prefix_ + "Heel", "the cloud has a hole at the heel");
    }
    if (toe) {
      place(prefix_ + "Toe", refined_end(*toe, ahead, 0.012), covariance(ahead, 0.007, 0.012));
    } else {
      miss(prefix_ + "Toe", "the cloud has a hole at the toes");
    }
    // The outer ankle lies above the rear fifth of the foot.
    const Vector3d rear = foot->centre - 0.5 * foot->length * ahead;
    std::vector<int> nodes;
    for (const int i : leg_nodes(figure_, side_, 0.036, 0.060))
      if (std::abs((figure_.graph.nodes[i] - rear).dot(ahead) - 0.19 * foot->length) < 0.015) nodes.push_back(i);
    const Vector3d outer = sideways.dot(outside()) > 0 ? sideways : Vector3d(-sideways);
    const auto ankle = outermost(nodes, outer);
    if (!ankle) return miss(prefix_ + "Ankle", "the cloud has a hole at the ankle");
    Matrix3d spread = covariance(outer, 0.010, 0.014);
    place(prefix_ + "Ankle", *ankle, spread);
  }

  const PointCloud& cloud_;
  const Figure& figure_;
  const BodyParts& parts_;
  const Facing& facing_;
  Detections& found_;
  std::vector<Vector3d> points_;
  PointGrid grid_;
  std::string prefix_;
  int side_ = 0;
};

}  // namespace

void find_body_landmarks(const Subject& subject, Detections& detections) {
  BodyFinder(subject, detections).find();
}

}  // namespace gyre
