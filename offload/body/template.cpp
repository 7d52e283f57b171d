// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template.h"

#include "common/log/log.h"

#include <cassert>
#include <cstdlib>

namespace gyre {
namespace {

Eigen::Affine3d blended(const SkinWeights& skin, const std::vector<Eigen::Affine3d>& posed_from_rest) {
  Eigen::Matrix<double, 3, 4> sum = Eigen::Matrix<double, 3, 4>::Zero();
  for (std::size_t k = 0; k < skin.joint.size(); ++k)
    if (skin.weight[k] != 0)
      sum += static_cast<double>(skin.weight[k]) * posed_from_rest[skin.joint[k]].matrix().topRows<3>();
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.matrix().topRows<3>() = sum;
  return transform;
}

std::filesystem::path user_template() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data && *data)
    return std::filesystem::path(data) / "gyre" / "template.glb";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::filesystem::path(home) / ".local" / "share" / "gyre" / "template.glb";
  return {};
}

}  // namespace

int BodyTemplate::joint_index(std::string_view joint) const {
  for (std::size_t i = 0; i < joints.size(); ++i)
    if (joints[i].name == joint) return static_cast<int>(i);
  return -1;
}

const TemplatePart* BodyTemplate::part(std::string_view wanted) const {
  for (const TemplatePart& p : parts)
    if (p.name == wanted) return &p;
  return nullptr;
}

std::vector<Eigen::Vector3d> shaped_vertices(const BodyTemplate& body, const Eigen::VectorXd& shape,
                                             const Eigen::VectorXd& head) {
  std::vector<Eigen::Vector3d> vertices = body.mesh.vertices;
  add_morphs(vertices, body.shapes, shape);
  add_morphs(vertices, body.head_shapes, head);
  return vertices;
}

std::vector<Eigen::Vector3d> joint_positions(const BodyTemplate& body,
                                             const std::vector<Eigen::Vector3d>& rest_vertices) {
  assert(rest_vertices.size() == body.mesh.vertices.size());
  std::vector<Eigen::Vector3d> positions(body.joints.size(), Eigen::Vector3d::Zero());
  for (std::size_t j = 0; j < body.joints.size(); ++j)
    for (const auto& [vertex, weight] : body.joints[j].regressor) positions[j] += weight * rest_vertices[vertex];
  return positions;
}

std::vector<Eigen::Affine3d> joint_transforms(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_joints,
                                              const BodyPose& pose) {
  assert(rest_joints.size() == body.joints.size() && pose.rotations.size() == body.joints.size());
  std::vector<Eigen::Affine3d> posed_from_rest(body.joints.size());
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    const double angle = pose.rotations[j].norm();
    const Eigen::AngleAxisd turn(
        angle, angle > 0 ? Eigen::Vector3d(pose.rotations[j] / angle) : Eigen::Vector3d(Eigen::Vector3d::UnitX()));
    const Eigen::Affine3d about_joint =
        Eigen::Translation3d(rest_joints[j]) * turn * Eigen::Translation3d(-rest_joints[j]);
    const int parent = body.joints[j].parent;
    posed_from_rest[j] =
        parent < 0 ? Eigen::Translation3d(pose.translation) * about_joint : posed_from_rest[parent] * about_joint;
  }
  return posed_from_rest;
}

std::vector<Eigen::Vector3d> skin_vertices(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                                           const std::vector<Eigen::Affine3d>& posed_from_rest) {
  assert(rest_vertices.size() == body.skin.size());
  std::vector<Eigen::Vector3d> posed(rest_vertices.size());
  for (std::size_t v = 0; v < posed.size(); ++v) posed[v] = blended(body.skin[v], posed_from_rest) * rest_vertices[v];
  return posed;
}

std::vector<Eigen::Vector3d> unskin_vertices(const BodyTemplate& body,
                                             const std::vector<Eigen::Vector3d>& posed_vertices,
                                             const std::vector<Eigen::Affine3d>& posed_from_rest) {
  assert(posed_vertices.size() == body.skin.size());
  std::vector<Eigen::Vector3d> rest(posed_vertices.size());
  for (std::size_t v = 0; v < rest.size(); ++v)
    rest[v] = blended(body.skin[v], posed_from_rest).inverse(Eigen::Affine) * posed_vertices[v];
  return rest;
}

void add_morphs(std::vector<Eigen::Vector3d>& vertices, const std::vector<Morph>& morphs,
                const Eigen::VectorXd& weights) {
  const auto used = std::min<std::size_t>(static_cast<std::size_t>(weights.size()), morphs.size());
  for (std::size_t k = 0; k < used; ++k) add_morph(vertices, morphs[k], weights[static_cast<Eigen::Index>(k)]);
}

void add_morph(std::vector<Eigen::Vector3d>& vertices, const Morph& morph, double weight) {
  if (weight == 0) return;
  for (std::size_t i = 0; i < morph.vertices.size(); ++i)
    vertices[morph.vertices[i]] += weight * morph.offsets[i].cast<double>();
}

Result<std::filesystem::path> find_template_file(const std::filesystem::path& given) {
  std::filesystem::path named = given;
  if (const char* variable = std::getenv("GYRE_TEMPLATE"); named.empty() && variable != nullptr) named = variable;
  std::error_code ignored;
  if (!named.empty()) {
    if (std::filesystem::exists(named, ignored)) return named;
    return wrong_use("no such template", named.string(), "make one with `gyre-offload template build`");
  }
  for (const std::filesystem::path& place : {user_template(), std::filesystem::path("/usr/share/gyre/template.glb")}) {
    if (!place.empty() && std::filesystem::exists(place, ignored)) return place;
  }
  return std::filesystem::path();
}

Result<BodyTemplate> find_template(const std::filesystem::path& given) {
  const Result<std::filesystem::path> file = find_template_file(given);
  if (!file) return tl::unexpected(file.error());
  if (!file->empty()) return read_template(*file);
  spdlog::warn("template: none found; using the built-in human, which has no face rig");
  return built_in_template();
}

}  // namespace gyre
