// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/avatar_file.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <span>
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

namespace gyre {

namespace {

template <class T>
std::vector<T> values(const tinygltf::Model& model, int accessor) {
  const tinygltf::Accessor& a = model.accessors.at(accessor);
  const tinygltf::BufferView& view = model.bufferViews.at(a.bufferView);
  std::vector<T> out(a.count);
  std::memcpy(static_cast<void*>(out.data()), model.buffers[view.buffer].data.data() + view.byteOffset + a.byteOffset,
              a.count * sizeof(T));
  return out;
}

void read_joints(const tinygltf::Model& model, Avatar& avatar) {
  const std::vector<int>& joints = model.skins.at(0).joints;
  const auto index = [&](int node) { return std::find(joints.begin(), joints.end(), node) - joints.begin(); };
  for (const int node : joints) {
    const std::vector<double>& t = model.nodes[node].translation;
    AvatarJoint joint{model.nodes[node].name, -1, Eigen::Vector3d::Zero()};
    if (t.size() == 3) joint.position = Eigen::Vector3d::Map(t.data());
    avatar.joints.push_back(joint);
  }
  for (const int node : joints)
    for (const int child : model.nodes[node].children)
      avatar.joints[index(child)].parent = static_cast<int>(index(node));
  for (AvatarJoint& joint : avatar.joints)  // parents come first
    if (joint.parent >= 0) joint.position += avatar.joints[joint.parent].position;
}

}  // namespace

Result<AvatarFile> read_avatar_file(const std::filesystem::path& file) {
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int,
                           void*) { return true; },
                        nullptr);
  tinygltf::Model model;
  std::string error, warning;
  if (!loader.LoadBinaryFromFile(&model, &error, &warning, file.string()))
    return fail("cannot read the avatar", file.string() + ": " + error, "give an avatar.glb that Gyre has written");
  AvatarFile read;
  Avatar& avatar = read.avatar;
  const tinygltf::Mesh& mesh = model.meshes.at(0);
  const tinygltf::Primitive& primitive = mesh.primitives.at(0);
  avatar.positions = values<Eigen::Vector3f>(model, primitive.attributes.at("POSITION"));
  avatar.uv = values<Eigen::Vector2f>(model, primitive.attributes.at("TEXCOORD_0"));
  const auto joints = values<std::array<std::uint8_t, 4>>(model, primitive.attributes.at("JOINTS_0"));
  const auto weights = values<std::array<float, 4>>(model, primitive.attributes.at("WEIGHTS_0"));
  for (std::size_t v = 0; v < joints.size(); ++v) {
    SkinWeights& skin = avatar.skin.emplace_back();
    std::copy(joints[v].begin(), joints[v].end(), skin.joint.begin());
    skin.weight = weights[v];
  }
  const auto indices = values<std::uint32_t>(model, primitive.indices);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    avatar.triangles.emplace_back(static_cast<int>(indices[i]), static_cast<int>(indices[i + 1]),
                                  static_cast<int>(indices[i + 2]));
  read_joints(model, avatar);
  for (std::size_t m = 0; m < primitive.targets.size(); ++m)
    avatar.morphs.push_back({mesh.extras.Get("targetNames").Get(static_cast<int>(m)).Get<std::string>(),
                             values<Eigen::Vector3f>(model, primitive.targets[m].at("POSITION")),
                             {}});
  if (!model.images.empty()) {
    const tinygltf::BufferView& view = model.bufferViews.at(model.images[0].bufferView);
    const std::span bytes(model.buffers[view.buffer].data.data() + view.byteOffset, view.byteLength);
    read.picture = cv::imdecode(std::vector<unsigned char>(bytes.begin(), bytes.end()), cv::IMREAD_COLOR);
  }
  return read;
}

TriangleMesh posed_mesh(const Avatar& avatar, const std::map<std::string, double>& expressions,
                        const std::map<std::string, Eigen::Vector3d>& turns) {
  std::vector<Eigen::Affine3d> posed_from_rest;
  for (const AvatarJoint& joint : avatar.joints) {
    Eigen::Affine3d own = Eigen::Affine3d::Identity();
    if (const auto turn = turns.find(joint.name); turn != turns.end())
      own = Eigen::Translation3d(joint.position) * Eigen::AngleAxisd(turn->second.norm(), turn->second.normalized()) *
            Eigen::Translation3d(-joint.position);
    posed_from_rest.push_back(joint.parent < 0 ? own : posed_from_rest[joint.parent] * own);
  }
  TriangleMesh mesh;
  mesh.triangles = avatar.triangles;
  mesh.uv_triangles = avatar.triangles;
  for (const Eigen::Vector2f& uv : avatar.uv) mesh.uv.emplace_back(uv.cast<double>());
  for (std::size_t v = 0; v < avatar.positions.size(); ++v) {
    Eigen::Vector3d rest = avatar.positions[v].cast<double>();
    for (const AvatarMorph& morph : avatar.morphs)
      if (const auto weight = expressions.find(morph.name); weight != expressions.end())
        rest += weight->second * morph.positions[v].cast<double>();
    Eigen::Vector3d posed = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 4; ++k)
      if (avatar.skin[v].weight[k] > 0)
        posed += avatar.skin[v].weight[k] * (posed_from_rest[avatar.skin[v].joint[k]] * rest);
    mesh.vertices.push_back(posed);
  }
  return mesh;
}

}  // namespace gyre
