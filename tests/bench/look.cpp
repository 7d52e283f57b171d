// SPDX-License-Identifier: Apache-2.0
// Draws an avatar as a person looks at it: from eight sides, the face at half a metre, hands, expressions and poses, as
// one picture.
//
//   look AVATAR.glb OUT.png
#include "common/geometry/camera.h"
#include "common/render/rasterise.h"
#include "tests/bench/avatar_file.h"

#include <cstdio>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

constexpr int width = 400, height = 560;
constexpr int supersampling = 2;
constexpr double degree = std::numbers::pi / 180.0;

struct Look {
  std::string title;
  std::map<std::string, double> expressions;
  std::map<std::string, Eigen::Vector3d> turns;
  double yaw = 0.0;  // degrees from which side: 0 the front, 90 the avatar's left
  // What is seen from half a metre: the face, or what lies around a joint; else the whole body.
  bool face = false;
  std::string joint = {};
};

std::vector<Look> looks() {
  std::vector<Look> all;
  const std::vector<const char*> sides = {"front", "front left", "left",  "back left",
                                          "back",  "back right", "right", "front right"};
  for (std::size_t i = 0; i < sides.size(); ++i) all.push_back({sides[i], {}, {}, 45.0 * static_cast<double>(i)});
  for (const auto& [title, yaw] : {std::pair("face", 0.0), {"face, 35 degrees", 35.0}, {"face, left", 90.0}})
    all.push_back({title, {}, {}, yaw, true});
  all.push_back({"jawOpen", {{"jawOpen", 1}}, {}, 20, true});
  all.push_back({"eyeBlinkLeft", {{"eyeBlinkLeft", 1}}, {}, 20, true});
  all.push_back({"mouthSmile", {{"mouthSmileLeft", 1}, {"mouthSmileRight", 1}}, {}, 20, true});
  const Eigen::Vector3d forward = Eigen::Vector3d::UnitX(), out = Eigen::Vector3d::UnitZ();
  all.push_back({"arms raised", {}, {{"leftUpperArm", 100 * degree * out}, {"rightUpperArm", -100 * degree * out}}});
  all.push_back({"a step",
                 {},
                 {{"leftUpperLeg", -35 * degree * forward},
                  {"leftLowerLeg", 20 * degree * forward},
                  {"rightUpperLeg", 20 * degree * forward},
                  {"rightLowerLeg", 35 * degree * forward},
                  {"leftUpperArm", 20 * degree * forward},
                  {"rightUpperArm", -30 * degree * forward}},
                 60});
  for (const auto& [title, yaw, joint] : {std::tuple("left hand, outside", 80.0, "leftMiddleProximal"),
                                          {"left hand, inside", -60.0, "leftMiddleProximal"},
                                          {"right hand, outside", -80.0, "rightMiddleProximal"},
                                          {"right hand, inside", 60.0, "rightMiddleProximal"}})
    all.push_back({title, {}, {}, yaw, false, joint});
  return all;
}

cv::Mat draw(const AvatarFile& file, const Look& look) {
  const TriangleMesh mesh = posed_mesh(file.avatar, look.expressions, look.turns);
  Eigen::Vector3d low = mesh.vertices.front(), high = low;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  Eigen::Vector3d target = 0.5 * (low + high);
  double distance = 3.0, extent = 1.08 * (high.y() - low.y());  // metres
  if (look.face) {
    for (const AvatarJoint& joint : file.avatar.joints)
      if (joint.name == "head") target = joint.position + Eigen::Vector3d(0, 0.045, 0.05);
    distance = 0.5;
    extent = 0.30;
  }
  for (const AvatarJoint& joint : file.avatar.joints) {
    if (look.joint.empty() || joint.name != look.joint) continue;
    target = joint.position;
    distance = 0.5;
    extent = 0.24;
  }
  const Eigen::Vector3d towards(std::sin(look.yaw * degree), look.face ? 0.03 : 0.0, std::cos(look.yaw * degree));
  const int w = supersampling * width, h = supersampling * height;
  const Camera camera = Camera::from_fov(w, h, 2 * std::atan(0.5 * extent / distance));
  cv::Mat picture = render(mesh, file.picture, camera, look_at(target + distance * towards, target));
  cv::resize(picture, picture, {width, height}, 0, 0, cv::INTER_AREA);
  cv::putText(picture, look.title, {10, 22}, cv::FONT_HERSHEY_SIMPLEX, 0.6, {60, 60, 60}, 1, cv::LINE_AA);
  return picture;
}

int look(const char* avatar, const char* out) {
  const auto file = read_avatar_file(avatar);
  if (!file) {
    std::fprintf(stderr, "look: %s\n", file.error().message().c_str());
    return file.error().exit_code();
  }
  constexpr int columns = 4;
  const std::vector<Look> all = looks();
  const int rows = (static_cast<int>(all.size()) + columns - 1) / columns;
  cv::Mat sheet(rows * height, columns * width, CV_8UC3, cv::Scalar::all(245));
  for (std::size_t i = 0; i < all.size(); ++i)
    draw(*file, all[i])
        .copyTo(sheet(
            cv::Rect(static_cast<int>(i % columns) * width, static_cast<int>(i / columns) * height, width, height)));
  if (!cv::imwrite(out, sheet)) {
    std::fprintf(stderr, "look: cannot write %s\n", out);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: look AVATAR.glb OUT.png\n");
    return 2;
  }
  return gyre::look(argv[1], argv[2]);
}
