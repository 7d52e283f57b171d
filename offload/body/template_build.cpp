// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template_build.h"

#include "offload/body/body_measures.h"
#include "offload/body/head_space.h"
#include "offload/body/humanoid.h"
#include "offload/body/joint_anatomy.h"
#include "offload/body/joint_range.h"
#include "offload/body/joint_regressor.h"
#include "offload/body/shape_space.h"
#include "offload/body/template_parts.h"
#include "offload/body/template_tools.h"

#include <spdlog/spdlog.h>
#include <Eigen/Dense>

namespace gyre {
namespace {

constexpr float tenth_of_a_millimetre = 1e-4F;

// The source bone whose head is a humanoid bone's joint; the source bones that are not listed join their nearest listed
// ancestor.
const std::map<std::string, std::string>& source_bones() {
  static const std::map<std::string, std::string> names = [] {
    std::map<std::string, std::string> bones = {
        {"hips", "spine05"}, {"spine", "spine04"}, {"chest", "spine02"}, {"upperChest", "spine01"},
        {"neck", "neck01"},  {"head", "head"},     {"jaw", "jaw"}};
    for (const auto& [side, letter] : {std::pair<std::string, std::string>{"left", ".L"}, {"right", ".R"}}) {
      bones[side + "Eye"] = "eye" + letter;
      bones[side + "UpperLeg"] = "upperleg01" + letter;
      bones[side + "LowerLeg"] = "lowerleg01" + letter;
      bones[side + "Foot"] = "foot" + letter;
      bones[side + "Shoulder"] = "clavicle" + letter;
      bones[side + "UpperArm"] = "upperarm01" + letter;
      bones[side + "LowerArm"] = "lowerarm01" + letter;
      bones[side + "Hand"] = "wrist" + letter;
      const std::array<std::string, 5> fingers = {"Thumb", "Index", "Middle", "Ring", "Little"};
      for (int f = 0; f < 5; ++f)
        for (int phalanx = 0; phalanx < 3; ++phalanx) {
          static const std::array<std::string, 3> thumb = {"Metacarpal", "Proximal", "Distal"};
          static const std::array<std::string, 3> other = {"Proximal", "Intermediate", "Distal"};
          bones[side + fingers[f] + (f == 0 ? thumb : other)[phalanx]] =
              "finger" + std::to_string(f + 1) + "-" + std::to_string(phalanx + 1) + letter;
        }
    }
    return bones;
  }();
  return names;
}

constexpr std::array<const char*, 5> toe_bones = {"toe1-1", "toe2-1", "toe3-1", "toe4-1", "toe5-1"};

// Humanoid bone of each source bone.
Result<std::map<std::string, int>> folded_bones(const Sources& sources) {
  std::map<std::string, int> kept = {{"root", humanoid_bone("hips")}};
  for (const auto& [bone, source] : source_bones()) kept[source] = humanoid_bone(bone);
  for (const char* toe : toe_bones) {
    kept[std::string(toe) + ".L"] = humanoid_bone("leftToes");
    kept[std::string(toe) + ".R"] = humanoid_bone("rightToes");
  }
  for (const auto& [source, bone] : kept)
    if (!sources.bones.count(source)) return fail("rig without bone '" + source + "'");
  std::map<std::string, int> folded;
  for (const auto& [name, bone] : sources.bones) {
    std::string at = name;
    for (std::size_t steps = 0; !kept.count(at) && steps < sources.bones.size(); ++steps)
      at = sources.bones.at(at).parent;
    if (!kept.count(at)) return fail("bone without a kept ancestor", name);
    folded[name] = kept.at(at);
  }
  return folded;
}

// Base vertices whose mean is the joint of a humanoid bone.
std::vector<int> joint_vertices(const Sources& sources, const std::string& bone) {
  if (bone == "upperChest") {  // midway: the source's own joint there strays by centimetres as the chest changes
    std::vector<int> vertices = sources.bones.at(source_bones().at("chest")).head;
    const auto& neck = sources.bones.at(source_bones().at("neck")).head;
    vertices.insert(vertices.end(), neck.begin(), neck.end());
    return vertices;
  }
  if (source_bones().count(bone)) return sources.bones.at(source_bones().at(bone)).head;
  std::vector<int> vertices;  // toes: the middle of the five
  for (const char* toe : toe_bones) {
    const auto& head = sources.bones.at(std::string(toe) + (bone.starts_with("left") ? ".L" : ".R")).head;
    vertices.insert(vertices.end(), head.begin(), head.end());
  }
  return vertices;
}

std::vector<SkinWeights> make_skin(const Sources& sources, const std::map<std::string, int>& folded,
                                   const AssembledParts& assembled) {
  const int head = humanoid_bone("head"), left_eye = humanoid_bone("leftEye"), right_eye = humanoid_bone("rightEye");
  Eigen::MatrixXd base = Eigen::MatrixXd::Zero(BaseRanges::count, static_cast<Eigen::Index>(humanoid_bones().size()));
  for (const auto& [name, list] : sources.weights) {
    int bone = folded.count(name) ? folded.at(name) : head;
    if (bone == left_eye || bone == right_eye) bone = head;  // lids stay when the eyes turn; expressions move them
    for (const auto& [vertex, weight] : list) base(vertex, bone) += weight;
  }
  const std::map<std::string, int> rigid = {{"leftEye", left_eye},
                                            {"rightEye", right_eye},
                                            {"upperTeeth", head},
                                            {"lowerTeeth", humanoid_bone("jaw")},
                                            {"tongue", humanoid_bone("jaw")},
                                            {"lashes", head}};
  std::vector<SkinWeights> skin;
  for (const TemplatePart& part : assembled.parts)
    for (int v = part.first_vertex; v < part.first_vertex + part.vertex_count; ++v) {
      const BoundPoint& p = assembled.binding[v];
      SkinWeights weights;
      if (rigid.count(part.name)) {
        weights.joint[0] = rigid.at(part.name);
        weights.weight[0] = 1;
      } else {
        weights = strongest_joints(base.row(p.base[0]));
      }
      skin.push_back(weights);
    }
  return skin;
}

std::vector<BodyRegion> make_regions(const BodyTemplate& body, const std::vector<bool>& interior) {
  using enum BodyRegion;
  std::vector<bool> moved(body.mesh.vertices.size(), false);
  constexpr float expressive = 1e-3F;
  for (const Morph& morph : body.expressions)
    for (std::size_t i = 0; i < morph.vertices.size(); ++i)
      if (morph.offsets[i].norm() > expressive) moved[morph.vertices[i]] = true;
  std::vector<BodyRegion> regions;
  const auto body_count = static_cast<std::size_t>(body.parts[0].vertex_count);
  for (std::size_t v = 0; v < body.mesh.vertices.size(); ++v) {
    const BodyRegion region = region_of_bone(humanoid_bones()[body.skin[v].joint[0]].name);
    if (v >= body_count || interior[v]) {
      regions.push_back(inner);
    } else {
      regions.push_back(region == head && moved[v] ? face : region);
    }
  }
  return regions;
}

// Vertices of the hm08 mesh at landmarks; the left ones have their mirror on the right.
std::map<std::string, int> make_landmarks(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& joints) {
  std::map<std::string, int> landmarks = {{"crown", 881},     {"sellion", 132},  {"noseTip", 297},
                                          {"noseBase", 5072}, {"upperLip", 467}, {"lowerLip", 495},
                                          {"chin", 5225},     {"navel", 4121},   {"crotch", 4372}};
  std::map<std::string, int> left = {{"leftEyeInner", 7796}, {"leftEyeOuter", 7782},    {"leftUpperLid", 7773},
                                     {"leftLowerLid", 7787}, {"leftMouthCorner", 7272}, {"leftEar", 12038},
                                     {"leftShoulder", 8226}, {"leftElbow", 10042},      {"leftWrist", 10572},
                                     {"leftNipple", 8451},   {"leftKnee", 11223},       {"leftAnkle", 11444},
                                     {"leftHeel", 12442},    {"leftToe", 11551}};
  const std::map<std::string, std::string> tips = {{"leftThumbTip", "leftThumbDistal"},
                                                   {"leftIndexTip", "leftIndexDistal"},
                                                   {"leftFingertip", "leftMiddleDistal"},
                                                   {"leftRingTip", "leftRingDistal"},
                                                   {"leftLittleTip", "leftLittleDistal"}};
  for (const auto& [tip, bone] : tips) {
    const int joint = body.joint_index(bone);
    double farthest = -1;
    for (int v = 0; v < body.parts[0].vertex_count; ++v) {
      const double distance = (body.mesh.vertices[v] - joints[joint]).norm();
      if (body.skin[v].joint[0] != joint || distance <= farthest) continue;
      farthest = distance;
      left[tip] = v;
    }
  }
  for (const auto& [name, vertex] : left) {
    landmarks[name] = vertex;
    landmarks[mirrored_name(name)] = body.mirror[vertex];
  }
  return landmarks;
}

// Landmarks that the face model knows (points of iBUG), and the lowest point of each ear.
void add_face_landmarks(const HeadSpace& heads, BodyTemplate& body) {
  const auto add = [&](const std::string& name, int left) {
    body.landmarks["left" + name] = left;
    body.landmarks["right" + name] = body.mirror[left];
  };
  add("Nostril", heads.points[34]);
  add("Jaw", heads.points[10]);
  add("JawAngle", heads.points[12]);
  const int tip = body.landmarks.at("leftEar");
  constexpr double auricle = 0.8;  // share of the tip's distance from the midline where the ear begins
  const Eigen::Vector3d& at = body.mesh.vertices[tip];
  int lobe = tip;
  for (int v = 0; v < body.parts[0].vertex_count; ++v) {
    const Eigen::Vector3d& p = body.mesh.vertices[v];
    if (p.x() > auricle * at.x() && (p - at).norm() < 0.06 && p.y() < body.mesh.vertices[lobe].y()) lobe = v;
  }
  add("EarLobe", lobe);
}

// A third of the area of the triangles around each body vertex; inner parts and surfaces count almost nothing.
Eigen::VectorXd vertex_areas(const BodyTemplate& body) {
  Eigen::VectorXd area = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(body.mesh.vertices.size()), 1e-9);
  for (int t = 0; t < body.parts[0].triangle_count; ++t) {
    const Eigen::Vector3i& corners = body.mesh.triangles[t];
    const Eigen::Vector3d a = body.mesh.vertices[corners[0]];
    const double third = (body.mesh.vertices[corners[1]] - a).cross(body.mesh.vertices[corners[2]] - a).norm() / 6;
    for (int k = 0; k < 3; ++k)
      if (body.regions[corners[k]] != BodyRegion::inner) area[corners[k]] += third;
  }
  return area;
}

// Mean coefficients of one sex: components are orthogonal in the samples, so the least squares are projections.
Eigen::VectorXd mean_shape(const ShapeSpace& space, const Eigen::MatrixXf& samples, const std::vector<bool>& is_male,
                           bool male) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(samples.cols());
  double count = 0;
  for (Eigen::Index s = 0; s < samples.rows(); ++s)
    if (is_male[s] == male) {
      sum += samples.row(s).transpose().cast<double>();
      ++count;
    }
  const Eigen::MatrixXd& c = space.components;
  return (c.transpose() * c).ldlt().solve(c.transpose() * (sum / count - space.mean));
}

// What the joint of each bone may be made of: the eyeballs for the eyes, else the surface the bone or its parent moves.
std::vector<int> regressor_vertices(const BodyTemplate& body, int bone) {
  std::vector<int> vertices;
  if (const TemplatePart* eye = body.part(humanoid_bones()[bone].name)) {
    for (int v = 0; v < eye->vertex_count; ++v) vertices.push_back(eye->first_vertex + v);
    return vertices;
  }
  for (int v = 0; v < body.parts[0].vertex_count; ++v) {
    const SkinWeights& skin = body.skin[v];
    double share = 0;
    for (int k = 0; k < 4; ++k)
      if (skin.joint[k] == bone || skin.joint[k] == humanoid_bones()[bone].parent) share += skin.weight[k];
    if (share > 0.3 && body.regions[v] != BodyRegion::inner) vertices.push_back(v);
  }
  return vertices;
}

// Where each humanoid bone's joint should be in each of the bodies: where the source rig has it, but for the pelvis.
std::vector<Eigen::MatrixXd> wanted_joints(const Sources& sources,
                                           const std::vector<std::vector<Eigen::Vector3f>>& bodies) {
  std::vector<Eigen::MatrixXd> wanted;
  const auto rows = static_cast<Eigen::Index>(bodies.size());
  for (const HumanoidBone& bone : humanoid_bones()) {
    const std::vector<int> cube = joint_vertices(sources, bone.name);
    wanted.emplace_back(Eigen::MatrixXd::Zero(rows, 3));
    for (Eigen::Index s = 0; s < rows; ++s)
      for (int v : cube)
        wanted.back().row(s) += bodies[s][v].cast<double>().transpose() / static_cast<double>(cube.size());
  }
  const int hips = humanoid_bone("hips"), spine = humanoid_bone("spine");
  const int left = humanoid_bone("leftUpperLeg"), right = humanoid_bone("rightUpperLeg");
  for (Eigen::Index s = 0; s < rows; ++s) {
    const std::span<const Eigen::Vector3f> skin(bodies[s].data(), BaseRanges::body);
    for (const int side : {left, right})
      wanted[side].row(s) = hip_centre(wanted[side].row(s).transpose(), skin).transpose();
    wanted[hips].row(s) = pelvis_centre(wanted[left].row(s).transpose(), wanted[right].row(s).transpose(),
                                        wanted[spine].row(s).transpose())
                              .transpose();
  }
  return wanted;
}

void fit_joints(BodyTemplate& body, const Sources& sources, const Eigen::MatrixXf& samples,
                const std::vector<std::vector<Eigen::Vector3f>>& bodies) {
  double worst = 0, sum = 0;
  std::string worst_name;
  const std::vector<Eigen::MatrixXd> all_wanted = wanted_joints(sources, bodies);
  for (std::size_t j = 0; j < humanoid_bones().size(); ++j) {
    const Eigen::MatrixXd& wanted = all_wanted[j];
    const auto candidates = vertices_around(body.mesh.vertices, regressor_vertices(body, static_cast<int>(j)),
                                            wanted.colwise().mean().transpose(), 64);
    const JointRegressor fitted = fit_regressor(samples, candidates, wanted);
    body.joints.push_back({humanoid_bones()[j].name, humanoid_bones()[j].parent, fitted.weights, {}});
    sum += fitted.rms;
    spdlog::debug("template: joint {} follows within {:.2f} mm (rms)", body.joints.back().name, 1000 * fitted.rms);
    if (fitted.rms <= worst) continue;
    worst = fitted.rms;
    worst_name = body.joints.back().name;
  }
  spdlog::info("template: joints follow the samples within {:.2f} mm rms on average, {:.2f} mm at worst ({})",
               1000 * sum / static_cast<double>(body.joints.size()), 1000 * worst, worst_name);
}

}  // namespace

std::vector<Eigen::Vector3d> source_joints(const Sources& sources, const std::vector<Eigen::Vector3f>& base) {
  std::vector<Eigen::Vector3d> joints;
  for (const HumanoidBone& bone : humanoid_bones()) {
    const std::vector<int> around = joint_vertices(sources, bone.name);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int v : around) sum += base[v].cast<double>() / static_cast<double>(around.size());
    joints.push_back(sum);
  }
  return joints;
}

Result<void> TemplateBuildOptions::check() const {
  if (components < 1 || components > 30)
    return wrong_use("bad number of shape components", std::to_string(components), "give 1 to 30");
  if (head_modes < 1 || head_modes > 100)
    return wrong_use("bad number of head modes", std::to_string(head_modes), "give 1 to 100");
  if (bodies.count < 2 * components)
    return wrong_use("too few bodies", std::to_string(bodies.count), "give at least twice the components");
  return {};
}

Result<BodyTemplate> build_template(const std::filesystem::path& folder, const TemplateBuildOptions& options) {
  if (const auto ok = options.check(); !ok) return tl::unexpected(ok.error());
  const auto progress = [&](double done, std::string_view what) {
    if (options.progress) options.progress(done, what);
  };
  progress(0, "reading sources");
  const Result<Sources> sources = read_sources(folder);
  if (!sources) return tl::unexpected(sources.error());
  const Result<Survey> survey = read_survey(folder / "ansur");
  if (!survey) return tl::unexpected(survey.error());
  const auto folded = folded_bones(*sources);
  if (!folded) return tl::unexpected(folded.error());
  Result<AssembledParts> assembled = assemble_parts(*sources);
  if (!assembled) return tl::unexpected(assembled.error());

  progress(0.1, "sampling bodies");
  const auto fitted = fit_survey_bodies(*sources, *survey, options.bodies);
  if (!fitted) return tl::unexpected(fitted.error());
  const auto& bodies = fitted->bodies;

  BodyTemplate body;
  body.name = "gyre-human 1";
  body.notices = sources->notices;
  body.mesh = std::move(assembled->mesh);
  body.parts = assembled->parts;
  body.skin = make_skin(*sources, *folded, *assembled);
  const auto rows = static_cast<Eigen::Index>(bodies.size());
  const auto vertices = static_cast<Eigen::Index>(assembled->binding.size());
  Eigen::MatrixXf samples(rows, 3 * vertices);
  for (Eigen::Index s = 0; s < rows; ++s) {
    const auto positions = bound_positions(assembled->binding, bodies[s]);
    for (Eigen::Index v = 0; v < vertices; ++v)
      samples.row(s).segment<3>(3 * v) = positions[v].cast<float>().transpose();
  }
  const Eigen::VectorXf mean = samples.colwise().mean().transpose();
  double floor = std::numeric_limits<double>::infinity();
  for (Eigen::Index v = 0; v < body.parts[0].vertex_count; ++v) floor = std::min(floor, double(mean[3 * v + 1]));
  for (Eigen::Index v = 0; v < vertices; ++v)
    body.mesh.vertices.emplace_back(mean.segment<3>(3 * v).cast<double>() - Eigen::Vector3d(0, floor, 0));
  const auto add_expression = [&](std::string_view name) {
    const Target& target = sources->expressions.at(std::string(name));
    body.expressions.push_back(
        sparse_morph(std::string(name), bound_offsets(assembled->binding, target), tenth_of_a_millimetre / 2));
  };
  for (const std::string_view name : arkit_expressions()) add_expression(name);
  for (const std::string_view name : oculus_visemes()) add_expression(name);
  body.regions = make_regions(body, assembled->interior);
  body.mirror = assembled->mirror;
  const std::vector<int> by_position = mirror_by_position(body.mesh.vertices, 1e-3);
  for (std::size_t v = static_cast<std::size_t>(body.parts[0].vertex_count); v < body.mirror.size(); ++v)
    body.mirror[v] = by_position[v];

  progress(0.7, "principal components");
  const ShapeSpace space = principal_components(samples, vertex_areas(body), options.components);
  for (int k = 0; k < options.components; ++k) {
    const Eigen::MatrixXd offsets = space.components.col(k).reshaped<Eigen::RowMajor>(vertices, 3);
    body.shapes.push_back(sparse_morph("shape" + std::to_string(k), offsets, 0));
  }
  for (const bool male : {false, true})
    body.shape_means[male ? "male" : "female"] = mean_shape(space, samples, fitted->male, male);
  spdlog::info("template: {} shape components explain {:.1f} % of {} bodies", options.components,
               100 * space.explained.sum(), rows);

  progress(0.85, "joints");
  fit_joints(body, *sources, samples, bodies);
  body.landmarks = make_landmarks(body, joint_positions(body, body.mesh.vertices));

  progress(0.9, "heads");
  const Result<FaceModel> face = read_face_model(folder / "ict", options.head_modes);
  if (!face) return tl::unexpected(face.error());
  Result<HeadSpace> heads = transfer_head_space(body, *face);
  if (!heads) return tl::unexpected(heads.error());
  spdlog::info("template: {:.0f} % of the face lie on the face model's mean, {:.2f} mm rms from it",
               100 * heads->matched, 1000 * heads->distance);
  add_face_landmarks(*heads, body);
  body.head_shapes = std::move(heads->components);
  set_joint_ranges(body);
  progress(1, "done");
  return body;
}

}  // namespace gyre
