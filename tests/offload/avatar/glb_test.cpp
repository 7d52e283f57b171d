// SPDX-License-Identifier: Apache-2.0
// Reads written files back with another library's loader.
#include "offload/avatar/glb.h"
#include "tests/offload/avatar/small_template.h"

#include <gtest/gtest.h>
#include <cstring>
#include <set>
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

namespace gyre {
namespace {

Avatar avatar_of(const BodyTemplate& body) {
  auto avatar = assemble_avatar(body, body.mesh.vertices, joint_positions(body, body.mesh.vertices));
  EXPECT_TRUE(avatar) << avatar.error().message();
  const std::array<unsigned char, 3> picture = {1, 2, 3};
  for (const unsigned char c : picture) avatar->texture.push_back(std::byte{c});
  avatar->texture_type = "image/png";
  avatar->facts = {{"template", body.name}, {"built_in_template", body.built_in}};
  return *avatar;
}

tinygltf::Model load(const std::vector<std::byte>& bytes) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int,
                           void*) { return true; },
                        nullptr);
  tinygltf::Model model;
  std::string error, warning;
  const bool ok =
      loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                  static_cast<unsigned>(bytes.size()));
  EXPECT_TRUE(ok) << error;
  EXPECT_EQ(warning, "");
  return model;
}

// Elements of an accessor, `width` numbers each.
template <class T>
std::vector<std::vector<T>> values(const tinygltf::Model& model, int accessor, int width) {
  const tinygltf::Accessor& a = model.accessors[accessor];
  const tinygltf::BufferView& view = model.bufferViews[a.bufferView];
  EXPECT_EQ(view.byteStride, 0U);
  EXPECT_FALSE(a.sparse.isSparse);
  EXPECT_EQ(view.byteLength, a.count * width * sizeof(T));
  std::vector<std::vector<T>> out(a.count, std::vector<T>(width));
  const unsigned char* from = model.buffers[view.buffer].data.data() + view.byteOffset + a.byteOffset;
  for (std::size_t i = 0; i < a.count; ++i) std::memcpy(out[i].data(), from + i * width * sizeof(T), width * sizeof(T));
  return out;
}

// Global rest position of every node, from the local translations.
std::vector<Eigen::Vector3d> global_positions(const tinygltf::Model& model) {
  std::vector<Eigen::Vector3d> positions(model.nodes.size(), Eigen::Vector3d::Zero());
  const std::function<void(int, const Eigen::Vector3d&)> visit = [&](int n, const Eigen::Vector3d& parent) {
    const tinygltf::Node& node = model.nodes[n];
    positions[n] = parent;
    if (!node.translation.empty()) positions[n] += Eigen::Vector3d::Map(node.translation.data());
    for (const int child : node.children) visit(child, positions[n]);
  };
  for (const int root : model.scenes[model.defaultScene].nodes) visit(root, Eigen::Vector3d::Zero());
  return positions;
}

class GlbOf : public testing::TestWithParam<bool> {
 protected:
  const BodyTemplate body_ = GetParam() ? built_in_template() : small_template();
  const Avatar avatar_ = avatar_of(body_);
  const tinygltf::Model model_ = load(write_glb(avatar_));
};

TEST_P(GlbOf, HoldsOneSkinnedMeshAtTheRoot) {
  ASSERT_EQ(model_.meshes.size(), 1U);
  ASSERT_EQ(model_.meshes[0].primitives.size(), 1U);
  ASSERT_EQ(model_.skins.size(), 1U);
  EXPECT_TRUE(model_.animations.empty());
  EXPECT_TRUE(model_.cameras.empty());
  EXPECT_TRUE(model_.extensionsUsed.empty());
  int skinned = -1;
  for (const int n : model_.scenes[0].nodes) {
    if (model_.nodes[n].skin == 0) skinned = n;
  }
  ASSERT_GE(skinned, 0);
  EXPECT_EQ(model_.nodes[skinned].mesh, 0);
  EXPECT_TRUE(model_.nodes[skinned].translation.empty());
  EXPECT_EQ(model_.asset.extras.Get("template").Get<std::string>(), body_.name);
  EXPECT_EQ(model_.asset.extras.Get("built_in_template").Get<bool>(), body_.built_in);
}

TEST_P(GlbOf, NamesAndPlacesTheJoints) {
  const std::vector<Eigen::Vector3d> global = global_positions(model_);
  const auto& joints = model_.skins[0].joints;
  ASSERT_EQ(joints.size(), body_.joints.size());
  const std::vector<Eigen::Vector3d> truth = joint_positions(body_, body_.mesh.vertices);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    EXPECT_EQ(model_.nodes[joints[j]].name, body_.joints[j].name);
    EXPECT_LT((global[joints[j]] - truth[j]).norm(), 1e-9);
    if (body_.joints[j].parent < 0) continue;
    const auto& siblings = model_.nodes[joints[body_.joints[j].parent]].children;
    EXPECT_NE(std::find(siblings.begin(), siblings.end(), joints[j]), siblings.end());
  }
}

TEST_P(GlbOf, InverseBindMatricesUndoTheRestPose) {
  const std::vector<Eigen::Vector3d> global = global_positions(model_);
  const auto inverse = values<float>(model_, model_.skins[0].inverseBindMatrices, 16);
  ASSERT_EQ(inverse.size(), model_.skins[0].joints.size());
  for (std::size_t j = 0; j < inverse.size(); ++j) {
    Eigen::Matrix4d joint = Eigen::Matrix4d::Identity();
    joint.topRightCorner<3, 1>() = global[model_.skins[0].joints[j]];
    const Eigen::Matrix4d ibm = Eigen::Map<const Eigen::Matrix4f>(inverse[j].data()).cast<double>();
    EXPECT_LT((joint * ibm - Eigen::Matrix4d::Identity()).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST_P(GlbOf, WeightsFollowTheRules) {
  const auto& attributes = model_.meshes[0].primitives[0].attributes;
  const auto joints = values<std::uint8_t>(model_, attributes.at("JOINTS_0"), 4);
  const auto weights = values<float>(model_, attributes.at("WEIGHTS_0"), 4);
  ASSERT_EQ(joints.size(), weights.size());
  EXPECT_EQ(attributes.count("JOINTS_1"), 0U);
  for (std::size_t v = 0; v < joints.size(); ++v) {
    std::set<int> used;
    float sum = 0;
    for (int k = 0; k < 4; ++k) {
      EXPECT_GE(weights[v][k], 0.0F);
      sum += weights[v][k];
      EXPECT_LT(joints[v][k], body_.joints.size());
      if (weights[v][k] == 0) {
        EXPECT_EQ(joints[v][k], 0);
      } else {
        EXPECT_TRUE(used.insert(joints[v][k]).second);
      }
    }
    EXPECT_NEAR(sum, 1.0F, 1e-6F);
  }
}

TEST_P(GlbOf, HoldsTheMeshInTheRestPose) {
  const auto& primitive = model_.meshes[0].primitives[0];
  const auto positions = values<float>(model_, primitive.attributes.at("POSITION"), 3);
  const auto indices = values<std::uint32_t>(model_, primitive.indices, 1);
  ASSERT_EQ(indices.size(), 3 * body_.mesh.triangles.size());
  const tinygltf::Accessor& accessor = model_.accessors[primitive.attributes.at("POSITION")];
  for (std::size_t i = 0; i < indices.size(); ++i) {
    ASSERT_LT(indices[i][0], positions.size());
    const auto& p = positions[indices[i][0]];
    const Eigen::Vector3f truth =
        body_.mesh.vertices[body_.mesh.triangles[i / 3][static_cast<int>(i % 3)]].cast<float>();
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(p[c], truth[c]);
      EXPECT_GE(p[c], accessor.minValues[c]);
      EXPECT_LE(p[c], accessor.maxValues[c]);
    }
  }
}

TEST_P(GlbOf, NamesEveryExpression) {
  const tinygltf::Mesh& mesh = model_.meshes[0];
  const auto& targets = mesh.primitives[0].targets;
  ASSERT_EQ(targets.size(), body_.expressions.size());
  if (targets.empty()) return;
  EXPECT_EQ(mesh.weights.size(), targets.size());
  const tinygltf::Value& names = mesh.extras.Get("targetNames");
  ASSERT_EQ(names.ArrayLen(), targets.size());
  const std::size_t vertices = model_.accessors[mesh.primitives[0].attributes.at("POSITION")].count;
  for (std::size_t m = 0; m < targets.size(); ++m) {
    EXPECT_EQ(names.Get(m).Get<std::string>(), body_.expressions[m].name);
    const auto moved = values<float>(model_, targets[m].at("POSITION"), 3);
    const auto turned = values<float>(model_, targets[m].at("NORMAL"), 3);
    EXPECT_EQ(moved.size(), vertices);
    EXPECT_EQ(turned.size(), vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
      for (int c = 0; c < 3; ++c) EXPECT_EQ(moved[v][c], avatar_.morphs[m].positions[v][c]);
    }
  }
}

TEST_P(GlbOf, EmbedsTheTextureOnARoughMaterial) {
  ASSERT_EQ(model_.images.size(), 1U);
  EXPECT_EQ(model_.images[0].mimeType, "image/png");
  const tinygltf::BufferView& view = model_.bufferViews[model_.images[0].bufferView];
  EXPECT_EQ(view.byteLength, 3U);
  EXPECT_EQ(model_.buffers[0].data[view.byteOffset + 2], 3);
  ASSERT_EQ(model_.materials.size(), 1U);
  EXPECT_EQ(model_.materials[0].pbrMetallicRoughness.metallicFactor, 0.0);
  EXPECT_EQ(model_.materials[0].pbrMetallicRoughness.roughnessFactor, 1.0);
  EXPECT_EQ(model_.materials[0].pbrMetallicRoughness.baseColorTexture.index, 0);
}

TEST_P(GlbOf, KeepsItsSkeletonInTheScene) {
  const tinygltf::Skin& skin = model_.skins[0];
  EXPECT_LT(skin.joints.size(), 128U);
  std::set<int> below;  // the skeleton's root
  const std::function<void(int)> visit = [&](int n) {
    below.insert(n);
    for (const int child : model_.nodes[n].children) visit(child);
  };
  visit(skin.skeleton);
  for (const int joint : skin.joints) EXPECT_TRUE(below.contains(joint)) << model_.nodes[joint].name;
  const auto& roots = model_.scenes[model_.defaultScene].nodes;
  EXPECT_NE(std::find(roots.begin(), roots.end(), skin.skeleton), roots.end());
  for (const tinygltf::Node& node : model_.nodes)
    EXPECT_TRUE(node.rotation.empty() && node.scale.empty() && node.matrix.empty()) << node.name;
}

TEST_P(GlbOf, SaysWhatEveryBufferViewAndNumberIs) {
  const auto& primitive = model_.meshes[0].primitives[0];
  EXPECT_EQ(model_.accessors[primitive.attributes.at("WEIGHTS_0")].componentType, TINYGLTF_COMPONENT_TYPE_FLOAT);
  std::vector<int> vertex_data;
  for (const auto& [name, accessor] : primitive.attributes) vertex_data.push_back(accessor);
  for (const auto& target : primitive.targets) {
    EXPECT_EQ(target.size(), 2U);
    EXPECT_EQ(model_.accessors[target.at("POSITION")].minValues.size(), 3U);
    EXPECT_EQ(model_.accessors[target.at("POSITION")].maxValues.size(), 3U);
    for (const auto& [name, accessor] : target) vertex_data.push_back(accessor);
  }
  for (const int accessor : vertex_data)
    EXPECT_EQ(model_.bufferViews[model_.accessors[accessor].bufferView].target, TINYGLTF_TARGET_ARRAY_BUFFER);
  EXPECT_EQ(model_.bufferViews[model_.accessors[primitive.indices].bufferView].target,
            TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  EXPECT_EQ(model_.bufferViews[model_.accessors[model_.skins[0].inverseBindMatrices].bufferView].target, 0);
}

TEST_P(GlbOf, TakesANormalMapWithTangents) {
  EXPECT_FALSE(model_.meshes[0].primitives[0].attributes.contains("TANGENT"));
  Avatar avatar = avatar_;
  add_normal_map(avatar, {std::byte{7}});
  const tinygltf::Model model = load(write_glb(avatar));
  const auto& attributes = model.meshes[0].primitives[0].attributes;
  const auto normals = values<float>(model, attributes.at("NORMAL"), 3);
  const auto tangents = values<float>(model, attributes.at("TANGENT"), 4);
  ASSERT_EQ(tangents.size(), normals.size());
  for (std::size_t v = 0; v < tangents.size(); ++v) {
    const Eigen::Vector3f n = Eigen::Vector3f::Map(normals[v].data()), t = Eigen::Vector3f::Map(tangents[v].data());
    EXPECT_NEAR(t.norm(), 1, 1e-5);
    EXPECT_NEAR(t.dot(n), 0, 1e-5);
    EXPECT_EQ(std::abs(tangents[v][3]), 1.0F);
  }
  const int image = model.textures.at(model.materials[0].normalTexture.index).source;
  EXPECT_EQ(model.images.at(image).mimeType, "image/png");
  EXPECT_EQ(model.buffers[0].data[model.bufferViews[model.images[image].bufferView].byteOffset], 7);
  EXPECT_NE(image, model.textures.at(model.materials[0].pbrMetallicRoughness.baseColorTexture.index).source);
}

TEST_P(GlbOf, EqualAvatarsGiveEqualBytes) {
  EXPECT_EQ(write_glb(avatar_), write_glb(avatar_of(body_)));
}

INSTANTIATE_TEST_SUITE_P(Templates, GlbOf, testing::Values(false, true),
                         [](const auto& which) { return which.param ? "BuiltIn" : "Box"; });

}  // namespace
}  // namespace gyre
