// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/fit/random_person.h"

#include "common/mesh/closest_point.h"
#include "offload/fit/stance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace gyre {

namespace {

constexpr double degree = std::numbers::pi / 180.0;

std::vector<double> distances(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& vertices,
                              const std::vector<Eigen::Vector3i>& triangles) {
  const ClosestPoint surface(vertices, triangles);
  std::vector<double> found;
  for (const Eigen::Vector3d& p : points)
    if (const auto nearest = surface.nearest(p)) found.push_back(nearest->distance);
  return found;
}

}  // namespace

RandomPerson random_person(const BodyTemplate& body, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  // The standard's distributions differ between libraries.
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  RandomPerson person;
  person.yaw = uniform(-std::numbers::pi, std::numbers::pi);
  double top = 0.0;
  for (const Eigen::Vector3d& v : body.mesh.vertices) top = std::max(top, v.y());
  Stance stance;
  stance.height = top;
  stance.lateral = Eigen::AngleAxisd(person.yaw, Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitX();
  person.state = stand_like(body, stance, person.yaw);
  const auto turn = [&](const std::string& name, const Eigen::Vector3d& by) {
    const int joint = body.joint_index(name);
    if (joint < 0) return;
    Eigen::Vector3d& rotation = person.state.pose.rotations[joint];
    rotation = rotation_vector_of(rotation_of(by) * rotation_of(rotation));
  };
  const auto wobble = [&](const std::string& name, double largest) {
    turn(name, largest * degree * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)));
  };
  for (const char* name : {"spine", "chest", "upperChest"}) wobble(name, 2.5);
  for (const char* name : {"neck", "head"}) wobble(name, 5);
  const std::vector<Eigen::Vector3d> joints = joint_positions(body, body.mesh.vertices);
  for (const bool left : {true, false}) {
    const std::string side = left ? "left" : "right";
    const double outward = left ? 1.0 : -1.0;
    turn(side + "UpperArm", {0, uniform(-10, 10) * degree, outward * uniform(-12, 12) * degree});
    const int elbow = body.joint_index(side + "LowerArm"), hand = body.joint_index(side + "Hand");
    if (elbow >= 0 && hand >= 0) {
      // About the axis that brings the forearm forward; the bent elbow of the mean shape can straighten a little.
      const Eigen::Vector3d axis = (joints[hand] - joints[elbow]).cross(Eigen::Vector3d::UnitZ()).normalized();
      turn(side + "LowerArm", uniform(0, 20) * degree * axis);
    }
    wobble(side + "Hand", 6);
    turn(side + "UpperLeg", {uniform(-3, 3) * degree, 0, outward * uniform(1, 7) * degree});
    turn(side + "LowerLeg", {uniform(0, 5) * degree, 0, 0});
    wobble(side + "Foot", 3);
  }
  person.state.head = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(body.head_shapes.size()));
  for (Eigen::VectorXd* coefficients : {&person.state.shape, &person.state.head})
    for (double& c : *coefficients)
      // The sum of three uniform numbers is close enough to a Gaussian of standard deviation 1 within 2.
      c = (uniform(-1, 1) + uniform(-1, 1) + uniform(-1, 1)) * 2.0 / 3.0;
  person.posed = evaluate(body, person.state);
  double lowest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : person.posed.vertices) lowest = std::min(lowest, v.y());
  person.state.pose.translation.y() -= lowest;
  person.posed = evaluate(body, person.state);
  return person;
}

PointCloud with_flaws(const PointCloud& cloud, const RandomPerson& person, const BodyTemplate& body,
                      const FlawOptions& options) {
  std::mt19937_64 random(options.seed);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  std::vector<Eigen::Vector3d> arm_vertices;
  for (std::size_t v = 0; v < body.regions.size(); ++v)
    if (body.regions[v] == BodyRegion::left_arm || body.regions[v] == BodyRegion::right_arm)
      arm_vertices.push_back(person.posed.vertices[v]);
  constexpr double patch = 0.04;  // metres
  const auto on_arm = [&](const Eigen::Vector3d& p) {
    return std::any_of(arm_vertices.begin(), arm_vertices.end(),
                       [&](const Eigen::Vector3d& a) { return (a - p).squaredNorm() < 0.02 * 0.02; });
  };
  std::vector<char> lost(cloud.points.size(), 0);
  std::vector<std::size_t> arm;
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    if (on_arm(cloud.points[i].cast<double>())) arm.push_back(i);
  std::size_t gone = 0;
  while (!arm.empty() && static_cast<double>(gone) < options.arm_holes * static_cast<double>(arm.size())) {
    const Eigen::Vector3f centre = cloud.points[arm[random() % arm.size()]];
    for (const std::size_t i : arm) {
      if (lost[i] != 0 || (cloud.points[i] - centre).norm() > patch) continue;
      lost[i] = 1;
      ++gone;
    }
  }
  PointCloud flawed;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (lost[i] != 0) continue;
    flawed.points.push_back(cloud.points[i]);
    flawed.normals.push_back(cloud.normals[i]);
  }
  const auto strays = static_cast<std::size_t>(options.outliers * static_cast<double>(flawed.points.size()));
  for (std::size_t i = 0; i < strays; ++i) {
    flawed.points.emplace_back(
        Eigen::Vector3d(uniform(-0.7, 0.7), uniform(0.0, 1.9), uniform(-0.7, 0.7)).cast<float>());
    const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    flawed.normals.emplace_back(Eigen::Vector3d(r * std::cos(angle), z, r * std::sin(angle)).cast<float>());
  }
  return flawed;
}

const std::vector<std::string>& main_joint_names() {
  static const std::vector<std::string> names = {"hips",          "neck",          "head",          "leftUpperArm",
                                                 "leftLowerArm",  "leftHand",      "leftUpperLeg",  "leftLowerLeg",
                                                 "leftFoot",      "rightUpperArm", "rightLowerArm", "rightHand",
                                                 "rightUpperLeg", "rightLowerLeg", "rightFoot"};
  return names;
}

ClosedLoopErrors closed_loop_errors(const BodyTemplate& body, const RandomPerson& person,
                                    const std::vector<Eigen::Vector3d>& vertices,
                                    const std::vector<Eigen::Vector3d>& joints, double yaw) {
  ClosedLoopErrors errors;
  const auto& triangles = body.mesh.triangles;
  errors.true_to_fitted = distances(visible_points(person.posed.vertices, triangles, 15000, 400), vertices, triangles);
  errors.fitted_to_true = distances(visible_points(vertices, triangles, 15000, 400), person.posed.vertices, triangles);
  for (const std::string& name : main_joint_names())
    if (const int j = body.joint_index(name); j >= 0)
      errors.joints.push_back((joints[j] - person.posed.joint(j)).norm());
  errors.facing = std::abs(std::remainder(yaw - person.yaw, 2 * std::numbers::pi));
  const int left = body.joint_index("leftHand"), right = body.joint_index("rightHand");
  if (left >= 0 && right >= 0)
    errors.sides_swapped =
        (joints[left] - person.posed.joint(left)).norm() > (joints[left] - person.posed.joint(right)).norm();
  return errors;
}

}  // namespace gyre
