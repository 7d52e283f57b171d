// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/stance.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>
#include "common/geometry/quantile.h"

namespace gyre {

namespace {

constexpr int fewest = 20;  // points that make a hand, a foot or a head

std::optional<Eigen::Vector3d> mean(const std::vector<Eigen::Vector3d>& points) {
  if (static_cast<int>(points.size()) < fewest) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

template <class F>
std::vector<Eigen::Vector3d> select(const OrientedPoints& cloud, const F& keep) {
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d& p : cloud.positions)
    if (keep(p)) kept.push_back(p);
  return kept;
}

// Floor and height. Below 15 % of the height something must be there, else the world's floor counts: dark legs.
void measure_height(const OrientedPoints& cloud, Stance& stance) {
  std::vector<double> heights;
  for (const Eigen::Vector3d& p : cloud.positions) heights.push_back(p.y());
  const double top = quantile(heights, 0.9995), bottom = quantile(heights, 0.0005);
  stance.floor = bottom > 0.15 * top && top > 0 ? 0.0 : bottom;
  stance.height = std::max(top - stance.floor, 0.01);
}

// The axis of largest horizontal spread of the upper body, which has the arms.
void measure_axis(const OrientedPoints& cloud, Stance& stance) {
  std::vector<Eigen::Vector3d> upper = select(cloud, [&](const Eigen::Vector3d& p) {
    const double level = (p.y() - stance.floor) / stance.height;
    return level > 0.4 && level < 0.85;
  });
  if (static_cast<int>(upper.size()) < fewest) upper = cloud.positions;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : upper) centre += Eigen::Vector2d(p.x(), p.z());
  centre /= static_cast<double>(upper.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : upper) {
    const Eigen::Vector2d d = Eigen::Vector2d(p.x(), p.z()) - centre;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  stance.lateral = Eigen::Vector3d(major.x(), 0, major.y());
  stance.elongation = std::sqrt(axes.eigenvalues()[1] / std::max(axes.eigenvalues()[0], 1e-12));
}

// Below the head, which has no arms that could be missing on one side; across the axis the middle of the trunk.
void measure_middle(const OrientedPoints& cloud, Stance& stance) {
  const auto level = [&](const Eigen::Vector3d& p) { return (p.y() - stance.floor) / stance.height; };
  const Eigen::Vector3d across = stance.lateral.cross(Eigen::Vector3d::UnitY());
  std::vector<Eigen::Vector3d> head = select(cloud, [&](const Eigen::Vector3d& p) { return level(p) > 0.88; });
  std::vector<Eigen::Vector3d> trunk =
      select(cloud, [&](const Eigen::Vector3d& p) { return level(p) > 0.5 && level(p) < 0.75; });
  if (static_cast<int>(trunk.size()) < fewest) trunk = cloud.positions;
  if (static_cast<int>(head.size()) < fewest) head = trunk;
  std::vector<double> sideways;
  sideways.reserve(head.size());
  for (const Eigen::Vector3d& p : head) sideways.push_back(p.dot(stance.lateral));
  const double side = 0.5 * (quantile(sideways, 0.02) + quantile(sideways, 0.98));
  std::vector<double> depths;
  for (const Eigen::Vector3d& p : trunk)
    if (std::abs(p.dot(stance.lateral) - side) < 0.08 * stance.height) depths.push_back(p.dot(across));
  const double depth = 0.5 * (quantile(depths, 0.02) + quantile(depths, 0.98));
  stance.middle = side * stance.lateral + depth * across + stance.floor * Eigen::Vector3d::UnitY();
}

void measure_hands(const OrientedPoints& cloud, Stance& stance) {
  for (int s = 0; s < 2; ++s) {
    const double sign = s == 0 ? 1.0 : -1.0;
    const auto outward = [&](const Eigen::Vector3d& p) { return sign * (p - stance.middle).dot(stance.lateral); };
    const std::vector<Eigen::Vector3d> side = select(cloud, [&](const Eigen::Vector3d& p) {
      const double level = (p.y() - stance.floor) / stance.height;
      return level > 0.28 && level < 0.9 && outward(p) > 0;
    });
    std::vector<double> reaches;
    reaches.reserve(side.size());
    for (const Eigen::Vector3d& p : side) reaches.push_back(outward(p));
    const double reach = quantile(reaches, 0.999);
    if (reach < 0.17 * stance.height) continue;  // nothing outside of the trunk
    std::vector<Eigen::Vector3d> outermost;
    for (const Eigen::Vector3d& p : side)
      if (outward(p) > reach - 0.045 * stance.height) outermost.push_back(p);
    stance.sides[s].hand = mean(outermost);
  }
}

void measure_feet(const OrientedPoints& cloud, Stance& stance) {
  const Eigen::Vector3d across = stance.lateral.cross(Eigen::Vector3d::UnitY());
  double toes = 0.0;
  int counted = 0;
  for (int s = 0; s < 2; ++s) {
    const double sign = s == 0 ? 1.0 : -1.0;
    const auto on_side = [&](const Eigen::Vector3d& p) {
      const double outward = sign * (p - stance.middle).dot(stance.lateral);
      return outward > 0 && outward < 0.25 * stance.height;
    };
    const auto level = [&](const Eigen::Vector3d& p) { return (p.y() - stance.floor) / stance.height; };
    const auto foot =
        select(cloud, [&](const Eigen::Vector3d& p) { return on_side(p) && level(p) > -0.02 && level(p) < 0.05; });
    const auto shin =
        select(cloud, [&](const Eigen::Vector3d& p) { return on_side(p) && level(p) > 0.07 && level(p) < 0.16; });
    stance.sides[s].foot = mean(foot);
    if (!stance.sides[s].foot || static_cast<int>(shin.size()) < fewest) continue;
    const auto extent_middle = [&](const std::vector<Eigen::Vector3d>& points) {
      std::vector<double> depths;
      depths.reserve(points.size());
      for (const Eigen::Vector3d& p : points) depths.push_back(p.dot(across));
      return 0.5 * (quantile(depths, 0.03) + quantile(depths, 0.97));
    };
    toes += extent_middle(foot) - extent_middle(shin);
    ++counted;
  }
  if (counted > 0) stance.toes = toes / counted / stance.height;
}

// Turn that takes direction `from` to `to`, as a rotation vector.
Eigen::Vector3d turn_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return rotation_vector_of(Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix());
}

// The measured limb direction in the axes of the body, or the mirror image of the other side's, or nothing.
std::optional<Eigen::Vector3d> limb_direction(const std::optional<Eigen::Vector3d>& own,
                                              const Eigen::Vector3d& own_start,
                                              const std::optional<Eigen::Vector3d>& other,
                                              const Eigen::Vector3d& other_start, const Eigen::Matrix3d& facing) {
  if (own) return facing.transpose() * (*own - own_start);
  if (!other) return std::nullopt;
  const Eigen::Vector3d mirrored = facing.transpose() * (*other - other_start);
  return Eigen::Vector3d(-mirrored.x(), mirrored.y(), mirrored.z());
}

// Mean of the rest vertices of a region; where a template has none, the joint itself.
Eigen::Vector3d region_middle(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& vertices, BodyRegion region,
                              const Eigen::Vector3d& fallback) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (body.regions[v] != region) continue;
    sum += vertices[v];
    ++count;
  }
  return count > 0 ? Eigen::Vector3d(sum / count) : fallback;
}

}  // namespace

Stance measure_stance(const OrientedPoints& cloud) {
  Stance stance;
  measure_height(cloud, stance);
  measure_axis(cloud, stance);
  measure_middle(cloud, stance);
  measure_hands(cloud, stance);
  measure_feet(cloud, stance);
  return stance;
}

double heading(const Stance& stance, bool towards_left) {
  const Eigen::Vector3d left = towards_left ? stance.lateral : Eigen::Vector3d(-stance.lateral);
  const Eigen::Vector3d forward = left.cross(Eigen::Vector3d::UnitY());
  return std::atan2(forward.x(), forward.z());
}

BodyState stand_like(const BodyTemplate& body, const Stance& stance, double yaw) {
  BodyState state = rest_state(body);
  double top = 0.0;
  for (const Eigen::Vector3d& v : body.mesh.vertices) top = std::max(top, v.y());
  state.scale = stance.height / top;
  std::vector<Eigen::Vector3d> rest = body.mesh.vertices;
  for (Eigen::Vector3d& v : rest) v *= state.scale;
  const std::vector<Eigen::Vector3d> joints = joint_positions(body, rest);

  const Eigen::Matrix3d facing = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  state.pose.rotations[0] = yaw * up;
  // The trunk's middle comes to lie over the stance's; the soles on its floor.
  const Eigen::Vector3d trunk = region_middle(body, rest, BodyRegion::torso, joints[0]);
  const Eigen::Vector3d ground(trunk.x(), 0, trunk.z());
  state.pose.translation = stance.middle - joints[0] - facing * (ground - joints[0]);
  const auto placed = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return facing * (p - joints[0]) + joints[0] + state.pose.translation;
  };

  // Which measured side is the body's left.
  const int left = (facing * Eigen::Vector3d::UnitX()).dot(stance.lateral) > 0 ? 0 : 1;
  for (int s = 0; s < 2; ++s) {
    const bool is_left = s == 0;
    const std::string side = is_left ? "left" : "right", opposite = is_left ? "right" : "left";
    const StanceSide &own = stance.sides[is_left ? left : 1 - left], &other = stance.sides[is_left ? 1 - left : left];

    const int arm = body.joint_index(side + "UpperArm"), other_arm = body.joint_index(opposite + "UpperArm");
    const int hand = body.joint_index(side + "Hand");
    if (arm >= 0 && other_arm >= 0 && hand >= 0) {
      const Eigen::Vector3d a_pose =
          Eigen::AngleAxisd((is_left ? 1 : -1) * 40.0 / 180.0 * std::numbers::pi, Eigen::Vector3d::UnitZ()) *
          Eigen::Vector3d(-up);
      const Eigen::Vector3d hand_middle =
          region_middle(body, rest, is_left ? BodyRegion::left_hand : BodyRegion::right_hand, joints[hand]);
      const Eigen::Vector3d direction =
          limb_direction(own.hand, placed(joints[arm]), other.hand, placed(joints[other_arm]), facing).value_or(a_pose);
      state.pose.rotations[arm] = turn_between(hand_middle - joints[arm], direction);
    }
    const int leg = body.joint_index(side + "UpperLeg"), other_leg = body.joint_index(opposite + "UpperLeg");
    const int foot = body.joint_index(side + "Foot");
    if (leg >= 0 && other_leg >= 0 && foot >= 0) {
      const Eigen::Vector3d foot_middle =
          region_middle(body, rest, is_left ? BodyRegion::left_foot : BodyRegion::right_foot, joints[foot]);
      const auto direction =
          limb_direction(own.foot, placed(joints[leg]), other.foot, placed(joints[other_leg]), facing);
      if (direction) {
        // Only the spread: how far the feet stand forward depends on the unknown facing.
        const Eigen::Vector3d rest_direction = foot_middle - joints[leg];
        const Eigen::Vector3d aim(direction->x(), direction->y(), rest_direction.z());
        state.pose.rotations[leg] = turn_between(rest_direction, aim);
        state.pose.rotations[foot] = -state.pose.rotations[leg];
      }
    }
  }
  return state;
}

}  // namespace gyre
