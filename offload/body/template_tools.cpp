// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template_tools.h"

#include <cassert>

namespace gyre {

SkinWeights strongest_joints(const Eigen::VectorXd& weight_of_joint) {
  std::vector<int> order(static_cast<std::size_t>(weight_of_joint.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return weight_of_joint[a] > weight_of_joint[b]; });
  SkinWeights skin;
  double sum = 0;
  for (std::size_t k = 0; k < skin.joint.size(); ++k) sum += std::max(0.0, weight_of_joint[order[k]]);
  assert(sum > 0);
  for (std::size_t k = 0; k < skin.joint.size(); ++k) {
    const double weight = std::max(0.0, weight_of_joint[order[k]]) / sum;
    if (weight < 1e-4) continue;  // below what glTF's consumers keep
    skin.joint[k] = order[k];
    skin.weight[k] = static_cast<float>(weight);
  }
  // What was dropped goes to the strongest, which keeps the sum at 1 to the last bit.
  skin.weight[0] = 1.0F - (skin.weight[1] + skin.weight[2] + skin.weight[3]);
  return skin;
}

Morph sparse_morph(std::string name, const Eigen::MatrixXd& offsets, double least) {
  Morph morph;
  morph.name = std::move(name);
  for (Eigen::Index v = 0; v < offsets.rows(); ++v) {
    if (offsets.row(v).norm() <= least) continue;
    morph.vertices.push_back(static_cast<int>(v));
    morph.offsets.emplace_back(offsets.row(v).transpose().cast<float>());
  }
  return morph;
}

BodyRegion region_of_bone(std::string_view bone) {
  using enum BodyRegion;
  const bool left = bone.starts_with("left");
  const std::string_view part = bone.substr(left ? 4 : bone.starts_with("right") ? 5 : 0);
  const bool sided = part.size() < bone.size();
  if (part == "head" || part == "jaw" || part == "Eye") return head;
  if (part == "UpperArm" || part == "LowerArm") return left ? left_arm : right_arm;
  if (part == "UpperLeg" || part == "LowerLeg") return left ? left_leg : right_leg;
  if (part == "Foot" || part == "Toes") return left ? left_foot : right_foot;
  if (sided && part != "Shoulder") return left ? left_hand : right_hand;
  return torso;
}

BodyRegion mirrored_region(BodyRegion region) {
  using enum BodyRegion;
  switch (region) {
    case left_arm:
      return right_arm;
    case right_arm:
      return left_arm;
    case left_hand:
      return right_hand;
    case right_hand:
      return left_hand;
    case left_leg:
      return right_leg;
    case right_leg:
      return left_leg;
    case left_foot:
      return right_foot;
    case right_foot:
      return left_foot;
    case torso:
    case head:
    case face:
    case inner:
      return region;
  }
  return region;
}

std::vector<int> mirror_by_position(const std::vector<Eigen::Vector3d>& vertices, double tolerance) {
  std::vector<int> by_y(vertices.size());
  std::iota(by_y.begin(), by_y.end(), 0);
  std::stable_sort(by_y.begin(), by_y.end(), [&](int a, int b) { return vertices[a].y() < vertices[b].y(); });
  std::vector<int> mirror(vertices.size(), -1);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3d image(-vertices[v].x(), vertices[v].y(), vertices[v].z());
    double best = tolerance * tolerance;
    auto at = std::lower_bound(by_y.begin(), by_y.end(), image.y() - tolerance,
                               [&](int i, double y) { return vertices[i].y() < y; });
    for (; at != by_y.end() && vertices[*at].y() <= image.y() + tolerance; ++at) {
      const double distance = (vertices[*at] - image).squaredNorm();
      if (distance > best || (distance == best && mirror[v] >= 0)) continue;
      best = distance;
      mirror[v] = *at;
    }
  }
  return mirror;
}

}  // namespace gyre
