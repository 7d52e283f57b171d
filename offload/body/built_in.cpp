// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/sha256.h"
#include "offload/body/built_in_cage.h"
#include "offload/body/humanoid.h"
#include "offload/body/joint_range.h"
#include "offload/body/template.h"
#include "offload/body/template_tools.h"

#include <initializer_list>

namespace gyre {
namespace {

// Changes whenever the generator does: the built-in human's checksum is made from it.
constexpr std::string_view generator_version = "gyre built-in human 2";

struct ShapeRule {
  std::string name;
  std::function<Eigen::Vector3d(const CagePoint&)> offset;  // of one standard deviation
};

bool is_slender(BodyRegion region) {
  using enum BodyRegion;
  return region != torso && region != left_arm && region != right_arm && region != left_leg && region != right_leg;
}

// Hand-made stand-ins for principal components: one unit of each is about one standard deviation among adults.
std::vector<ShapeRule> shape_rules() {
  constexpr double crotch = 0.79, collar = 1.425, arm_root = 0.17;
  const auto stretched = [](double y, double legs, double trunk) {
    if (y < crotch) return legs * y;
    return legs * crotch + trunk * std::min(y - crotch, collar - crotch);
  };
  return {
      {"stature", [](const CagePoint& p) { return Eigen::Vector3d(0.04 * p.position); }},
      {"girth",
       [](const CagePoint& p) {
         return Eigen::Vector3d((is_slender(p.region) ? 0.02 : 0.1) * (p.position - p.centre));
       }},
      {"legLength",  // at the same stature
       [=](const CagePoint& p) {
         return Eigen::Vector3d(0, stretched(p.position.y(), 0.03, -0.03 * crotch / (collar - crotch)), 0);
       }},
      {"armLength",
       [=](const CagePoint& p) {
         const double out = std::max(0.0, std::abs(p.position.x()) - arm_root);
         const double reach = p.position.y() > 0.6 ? 0.06 * out : 0.0;
         return Eigen::Vector3d(std::copysign(reach, p.position.x()), -reach, 0);
       }},
      {"shoulderWidth",
       [=](const CagePoint& p) {
         const double up = std::clamp((p.position.y() - 1.1) / 0.2, 0.0, 1.0);
         const double arm = p.position.y() > 0.6 && std::abs(p.position.x()) > arm_root ? 1.0 : up;
         const double wide = std::min(std::abs(p.position.x()), arm_root) * 0.06 * arm;
         return Eigen::Vector3d(p.position.y() > collar ? 0.0 : std::copysign(wide, p.position.x()), 0, 0);
       }},
      {"belly",
       [](const CagePoint& p) {
         const double at = std::exp(-std::pow((p.position.y() - 1.03) / 0.1, 2));
         const bool trunk = p.region == BodyRegion::torso;
         return Eigen::Vector3d(trunk ? 0.1 * at * p.position.x() : 0.0, 0,
                                trunk && p.position.z() > 0 ? 0.025 * at : 0.0);
       }},
  };
}

std::vector<std::pair<int, double>> mean_of(const std::vector<int>& vertices) {
  std::vector<std::pair<int, double>> regressor;
  for (int v : vertices) regressor.emplace_back(v, 1.0 / static_cast<double>(vertices.size()));
  return regressor;
}

// Joints of the left side and the midline lie in the middle of cage rings; the cage's vertices stay vertices.
std::vector<Joint> make_joints(const HumanCage& cage) {
  std::map<std::string, std::vector<std::pair<int, double>>> regressors;
  const auto both = [&](std::initializer_list<const char*> names) {
    std::vector<int> vertices;
    for (const char* name : names)
      for (int v : cage.rings.at(name)) {
        vertices.push_back(v);
        vertices.push_back(cage.mirror[v]);
      }
    return mean_of(vertices);
  };
  const auto ring = [&](const std::string& name) -> const std::vector<int>& { return cage.rings.at(name); };
  regressors["hips"] = both({"hips"});
  regressors["spine"] = both({"loin"});
  regressors["chest"] = both({"ribs"});
  regressors["upperChest"] = both({"armpit"});
  regressors["neck"] = both({"collar"});
  regressors["head"] = both({"neck", "mouth"});
  const int jaw_front = ring("mouth")[1], jaw_back = ring("mouth")[2];
  regressors["jaw"] = mean_of({jaw_front, jaw_back, cage.mirror[jaw_front], cage.mirror[jaw_back]});
  regressors["leftEye"] = {{ring("eyes")[1], 0.5}, {ring("eyes")[0], 0.4}, {ring("eyes")[3], 0.1}};
  regressors["leftShoulder"] = mean_of({ring("collar")[0], ring("collar")[1], ring("collar")[2], ring("collar")[3],
                                        ring("shoulder")[0], ring("shoulder")[3]});
  regressors["leftUpperArm"] = mean_of(ring("upperArm"));
  regressors["leftLowerArm"] = mean_of(ring("elbow"));
  regressors["leftHand"] = mean_of(ring("wrist"));
  regressors["leftUpperLeg"] = mean_of({ring("hips")[1], ring("hips")[2], ring("crotch")[0], ring("crotch")[3]});
  regressors["leftLowerLeg"] = mean_of(ring("knee"));
  regressors["leftFoot"] = mean_of(ring("ankle"));
  regressors["leftToes"] = mean_of(ring("ball"));
  for (const std::string finger : {"Index", "Middle", "Ring", "Little"}) {
    regressors["left" + finger + "Proximal"] = mean_of(ring(finger + "0"));
    regressors["left" + finger + "Intermediate"] = mean_of(ring(finger + "1"));
    regressors["left" + finger + "Distal"] = mean_of(ring(finger + "2"));
  }
  std::vector<int> thumb_root = ring("wrist");
  thumb_root.insert(thumb_root.end(), ring("palm").begin(), ring("palm").end());
  thumb_root.insert(thumb_root.end(), ring("Thumb0").begin(), ring("Thumb0").end());
  regressors["leftThumbMetacarpal"] = mean_of(thumb_root);
  regressors["leftThumbProximal"] = mean_of(ring("Thumb1"));
  regressors["leftThumbDistal"] = mean_of(ring("Thumb2"));

  std::vector<Joint> joints;
  for (const HumanoidBone& bone : humanoid_bones()) {
    Joint joint{bone.name, bone.parent, {}, {}};
    if (regressors.count(bone.name)) {
      joint.regressor = regressors.at(bone.name);
    } else {
      joint.regressor = regressors.at(mirrored_name(bone.name));
      for (auto& [vertex, weight] : joint.regressor) vertex = cage.mirror[vertex];
    }
    joints.push_back(std::move(joint));
  }
  return joints;
}

std::map<std::string, int> make_landmarks(const HumanCage& cage) {
  std::map<std::string, int> landmarks = {
      {"crown", cage.rings.at("crown")[3]},  {"chin", cage.rings.at("chin")[0]},
      {"noseTip", cage.rings.at("nose")[0]}, {"sellion", cage.rings.at("eyes")[0]},
      {"navel", cage.rings.at("waist")[0]},  {"crotch", cage.rings.at("crotch")[0]}};
  const std::map<std::string, int> left = {
      {"leftShoulder", cage.rings.at("upperArm")[3]}, {"leftElbow", cage.rings.at("elbow")[2]},
      {"leftWrist", cage.rings.at("wrist")[2]},       {"leftFingertip", cage.rings.at("Middle3")[2]},
      {"leftThumbTip", cage.rings.at("Thumb3")[2]},   {"leftIndexTip", cage.rings.at("Index3")[2]},
      {"leftRingTip", cage.rings.at("Ring3")[2]},     {"leftLittleTip", cage.rings.at("Little3")[2]},
      {"leftKnee", cage.rings.at("knee")[0]},         {"leftAnkle", cage.rings.at("ankle")[0]},
      {"leftHeel", cage.rings.at("sole")[3]},         {"leftToe", cage.rings.at("toes")[1]}};
  for (const auto& [name, vertex] : left) {
    landmarks[name] = vertex;
    landmarks[mirrored_name(name)] = cage.mirror[vertex];
  }
  return landmarks;
}

}  // namespace

BodyTemplate built_in_template() {
  const HumanCage cage = human_cage();
  const int count = static_cast<int>(cage.points.size());
  const SubdividedCage fine = subdivide(count, cage.faces, 2);

  BodyTemplate body;
  body.name = "built-in";
  body.checksum = sha256(generator_version);
  body.notices = "Generated by Gyre (Apache-2.0).";
  body.built_in = true;

  Eigen::MatrixXd wanted(count, 3);
  for (int i = 0; i < count; ++i) wanted.row(i) = cage.points[i].position;
  Eigen::MatrixXd refined = fine.weights * cage_through(wanted, fine);
  refined.col(1).array() -= refined.col(1).minCoeff();
  for (Eigen::Index v = 0; v < refined.rows(); ++v) body.mesh.vertices.emplace_back(refined.row(v).transpose());
  std::map<std::pair<double, double>, int> uv_index;
  const auto uv_of = [&](const Eigen::Vector2d& uv) {
    const auto [at, is_new] = uv_index.try_emplace({uv.x(), uv.y()}, static_cast<int>(body.mesh.uv.size()));
    if (is_new) body.mesh.uv.push_back(uv);
    return at->second;
  };
  for (const CageFace& quad : fine.faces) {
    std::array<int, 4> uv{};
    for (int k = 0; k < 4; ++k) uv[k] = uv_of(quad.uv[k]);
    for (const auto& [a, b, c] : {std::tuple{0, 1, 2}, {0, 2, 3}}) {
      body.mesh.triangles.emplace_back(quad.corners[a], quad.corners[b], quad.corners[c]);
      body.mesh.uv_triangles.emplace_back(uv[a], uv[b], uv[c]);
    }
  }
  body.parts = {{"body", 0, static_cast<int>(refined.rows()), 0, static_cast<int>(body.mesh.triangles.size())}};

  const auto bones = static_cast<Eigen::Index>(humanoid_bones().size());
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(count, bones);
  for (int i = 0; i < count; ++i)
    for (const auto& [bone, weight] : cage.points[i].bones) weights(i, bone) = weight;
  const Eigen::MatrixXd fine_weights = fine.weights * weights;
  for (Eigen::Index v = 0; v < refined.rows(); ++v) body.skin.push_back(strongest_joints(fine_weights.row(v)));

  for (const ShapeRule& rule : shape_rules()) {
    Eigen::MatrixXd offsets(count, 3);
    for (int i = 0; i < count; ++i) offsets.row(i) = rule.offset(cage.points[i]);
    body.shapes.push_back(sparse_morph(rule.name, fine.weights * offsets, 1e-6));
  }

  for (Eigen::Index v = 0; v < refined.rows(); ++v) {
    Eigen::Index strongest = v;
    double most = 0;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator at(fine.weights, v); at; ++at)
      if (at.value() > most) {
        most = at.value();
        strongest = at.col();
      }
    body.regions.push_back(cage.points[strongest].region);
  }
  body.mirror = mirror_by_position(body.mesh.vertices, 1e-6);
  body.joints = make_joints(cage);
  body.landmarks = make_landmarks(cage);
  set_joint_ranges(body);
  return body;
}

}  // namespace gyre
