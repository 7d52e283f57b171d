// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/landmarks/people.h"

#include "common/render/rasterise.h"
#include "tests/offload/fit/sample_cloud.h"
#include "tests/synthetic/subject.h"

#include <numbers>

namespace gyre {

namespace {

// Meshes take seconds to make and serve many tests.
const synthetic::Subject& mesh_of(double stature, std::uint64_t seed) {
  static std::map<std::pair<double, std::uint64_t>, synthetic::Subject> made;
  const auto [at, is_new] = made.try_emplace({stature, seed});
  if (is_new) at->second = synthetic::make_subject({.stature = stature, .seed = seed});
  return at->second;
}

}  // namespace

Person synthetic_person(const PersonOptions& options) {
  const synthetic::Subject& subject = mesh_of(options.stature, options.seed);
  PointCloud all =
      sample_visible(subject.mesh.vertices, subject.mesh.triangles, {options.points, options.noise, 500, options.seed});
  PointCloud kept;
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    if (options.hole && options.hole(all.points[i].cast<double>())) continue;
    kept.points.push_back(all.points[i]);
    kept.normals.push_back(all.normals[i]);
  }
  Person person;
  person.yaw = options.yaw;
  person.cloud = moved(kept, options.yaw, Eigen::Vector3d::Zero());
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(options.yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (const synthetic::NamedJoint& joint : subject.joints) person.joints[joint.name] = turn * joint.position;
  return person;
}

std::vector<LandmarkView> views_around(double stature, int count) {
  std::vector<LandmarkView> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    LandmarkView view;
    view.name = "body-" + std::to_string(100000 + i) + ".jpg";
    view.camera = Camera::from_fov(480, 640, 0.9);
    view.cam_from_world =
        look_at({2.4 * std::sin(angle), 0.7 * stature, 2.4 * std::cos(angle)}, {0, 0.52 * stature, 0});
    views.push_back(view);
  }
  return views;
}

}  // namespace gyre
