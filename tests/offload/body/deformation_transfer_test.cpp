// SPDX-License-Identifier: Apache-2.0
// What deformation transfer must give whatever the surfaces are.
#include "offload/body/deformation_transfer.h"

#include "offload/body/template.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const BodyTemplate& human() {
  static const BodyTemplate body = built_in_template();
  return body;
}

using Points = std::vector<Eigen::Vector3d>;

// A smooth bend and swelling.
Points bent(const Points& x) {
  Points y;
  for (const Eigen::Vector3d& p : x)
    y.emplace_back(p.x() + 0.05 * std::sin(3 * p.y()), p.y() + 0.1 * p.x() * p.x(), 1.1 * p.z() + 0.04 * p.y() * p.y());
  return y;
}

Eigen::MatrixXd offsets_of(const Points& from, const Points& to) {
  Eigen::MatrixXd offsets(static_cast<Eigen::Index>(from.size()), 3);
  for (std::size_t v = 0; v < from.size(); ++v)
    offsets.row(static_cast<Eigen::Index>(v)) = (to[v] - from[v]).transpose();
  return offsets;
}

// The upper body moves, the rest is held.
std::vector<bool> upper_body() {
  std::vector<bool> movable;
  for (const Eigen::Vector3d& v : human().mesh.vertices) movable.push_back(v.y() > 1.2);
  return movable;
}

// A deformation of the movable vertices only.
Points swung(const Points& x) {
  Points y = x;
  for (std::size_t v = 0; v < x.size(); ++v)
    if (human().mesh.vertices[v].y() > 1.2)
      y[v] += 0.1 * (human().mesh.vertices[v].y() - 1.2) * Eigen::Vector3d(1, 0.3, 0);
  return y;
}

TEST(DeformationTransfer, NoMotionGivesExactlyNone) {
  const Points target = bent(human().mesh.vertices);
  const DeformationTransfer solver(human().mesh.vertices, target, human().mesh.triangles, upper_body());
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(target.size()), 6);
  EXPECT_EQ(solver.transfer(none).cwiseAbs().maxCoeff(), 0.0);
}

TEST(DeformationTransfer, ASurfaceToItselfGetsBackWhatItWasGiven) {
  const Points& x = human().mesh.vertices;
  const Eigen::MatrixXd given = offsets_of(x, swung(x));
  const DeformationTransfer held(x, x, human().mesh.triangles, upper_body());
  EXPECT_LT((held.transfer(given) - given).cwiseAbs().maxCoeff(), 1e-9);
  const Points deformed = bent(x), all = transfer_deformation(x, deformed, x, human().mesh.triangles);
  for (std::size_t v = 0; v < x.size(); ++v) ASSERT_LT((all[v] - deformed[v]).norm(), 1e-6);
}

TEST(DeformationTransfer, RigidMotionStaysRigid) {
  const Points &x = human().mesh.vertices, target = bent(x);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Points deformed;
  for (const Eigen::Vector3d& p : x) deformed.emplace_back(turn * p);
  const Points moved = transfer_deformation(x, deformed, target, human().mesh.triangles);
  for (const Eigen::Vector3i& t : human().mesh.triangles)
    ASSERT_LT((moved[t[1]] - moved[t[0]] - turn * (target[t[1]] - target[t[0]])).norm(), 1e-6);
}

TEST(DeformationTransfer, GrowsWithTheTarget) {
  const Points& x = human().mesh.vertices;
  Points larger;
  for (const Eigen::Vector3d& p : x) larger.emplace_back(1.3 * p);
  const Eigen::MatrixXd given = offsets_of(x, swung(x));
  const DeformationTransfer solver(x, larger, human().mesh.triangles, upper_body());
  EXPECT_LT((solver.transfer(given) - 1.3 * given).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(DeformationTransfer, TurnsWithTheTarget) {
  const Points& x = human().mesh.vertices;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
  Points turned;
  for (const Eigen::Vector3d& p : x) turned.emplace_back(turn * p);
  const Eigen::MatrixXd given = offsets_of(x, swung(x));
  const DeformationTransfer solver(x, turned, human().mesh.triangles, upper_body(), turn);
  EXPECT_LT((solver.transfer(given) - given * turn.transpose()).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(DeformationTransfer, HeldVerticesStayAndColumnsDoNotMix) {
  const Points &x = human().mesh.vertices, target = bent(x);
  const DeformationTransfer solver(x, target, human().mesh.triangles, upper_body());
  Eigen::MatrixXd given = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(x.size()), 6);
  given.rightCols<3>() = offsets_of(x, swung(x));
  const Eigen::MatrixXd moved = solver.transfer(given);
  EXPECT_EQ(moved.leftCols<3>().cwiseAbs().maxCoeff(), 0.0);
  EXPECT_LT((moved.rightCols<3>() - solver.transfer(given.rightCols<3>())).cwiseAbs().maxCoeff(), 1e-15);
  const std::vector<bool> movable = upper_body();
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (!movable[v]) {
      ASSERT_EQ(moved.row(static_cast<Eigen::Index>(v)).norm(), 0.0);
    }
  }
}

}  // namespace
}  // namespace gyre
