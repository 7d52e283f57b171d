// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/avatar_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/avatar/avatar.h"
#include "offload/avatar/fbx.h"
#include "offload/avatar/glb.h"
#include "offload/avatar/joint_names.h"
#include "offload/avatar/level_of_detail.h"
#include "offload/avatar/rebind.h"
#include "offload/avatar/vrm.h"
#include "offload/body/humanoid.h"
#include "offload/body/t_pose.h"
#include "offload/body/texture_file.h"

namespace gyre {

namespace {

Result<nlohmann::json> read_json(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto json = nlohmann::json::parse(*text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return fail("not a JSON object", file.string(), "run its stage again");
  return json;
}

// Positions by joint name, in the template's order.
Result<std::vector<Eigen::Vector3d>> joints_of(const nlohmann::json& fit, const BodyTemplate& body) {
  std::vector<Eigen::Vector3d> joints;
  const nlohmann::json positions = fit.value("rest_joints", nlohmann::json::object());
  for (const Joint& joint : body.joints) {
    const auto found = positions.find(joint.name);
    const bool good = found != positions.end() && found->is_array() && found->size() == 3 &&
                      std::all_of(found->begin(), found->end(), [](const auto& x) { return x.is_number(); });
    if (!good) return fail("fit.json lacks the rest position of a joint", joint.name, "run the fit stage again");
    joints.emplace_back((*found)[0].template get<double>(), (*found)[1].template get<double>(),
                        (*found)[2].template get<double>());
  }
  return joints;
}

// The avatar in the T-pose that VRM asks for.
Result<std::vector<std::byte>> vrm_of(const Avatar& avatar, const BodyTemplate& body,
                                      const std::vector<Eigen::Vector3d>& vertices,
                                      const std::vector<Eigen::Vector3d>& joints, const nlohmann::json& options) {
  const ReposedSurface reposed = repose(body, vertices, joints, t_pose(body, joints));
  std::vector<std::string> bones;
  for (const Joint& joint : body.joints) bones.push_back(humanoid_bone(joint.name) < 0 ? "" : joint.name);
  VrmMeta meta;
  if (const std::string author = options.value("author", std::string()); !author.empty()) meta.author = author;
  Avatar t_posed = rebound(avatar, reposed.reposed_from_rest);
  t_posed.tangents.clear();  // VRM leaves them to the player
  return write_vrm(t_posed, bones, meta);
}

Result<nlohmann::json> run(const StageContext& context) {
  const std::string word = context.options.value("joint_names", std::string("vrm"));
  const auto naming = joint_naming(word);
  if (!naming) return fail("no such naming of joints", word, "choose vrm, mixamo or unreal");
  const auto body = find_template(context.options.value("template", std::string()));
  if (!body) return tl::unexpected(body.error());
  const auto rest = read_ply(context.bundle.work("fit") / "rest.ply");
  if (!rest) return tl::unexpected(rest.error());
  const auto fit = read_json(context.bundle.work("fit") / "fit.json");
  if (!fit) return tl::unexpected(fit.error());
  const auto joints = joints_of(*fit, *body);
  if (!joints) return tl::unexpected(joints.error());
  const auto scene = read_json(context.bundle.work("cameras") / "scene.json");
  if (!scene) return tl::unexpected(scene.error());
  const std::filesystem::path picture = texture_file(context.bundle, "albedo");
  const auto texture = read_file(picture);
  if (!texture) return tl::unexpected(texture.error());

  context.progress(0.2, "assembling");
  auto avatar = assemble_avatar(*body, rest->vertices, *joints);
  if (!avatar) return tl::unexpected(avatar.error());
  const auto bytes_of_texture = std::as_bytes(std::span(*texture));
  avatar->texture.assign(bytes_of_texture.begin(), bytes_of_texture.end());
  avatar->texture_type = picture_type(picture);
  if (const auto relief = read_file(context.bundle.work("texture") / "normal.png")) {
    const auto bytes = std::as_bytes(std::span(*relief));
    add_normal_map(*avatar, {bytes.begin(), bytes.end()});
  }
  avatar->facts = {{"template", body->name},
                   {"template_checksum", body->checksum},
                   {"built_in_template", body->built_in},
                   {"scale_source", scene->value("scale_source", "unknown")}};
  if (!body->notices.empty()) avatar->facts["notices"] = body->notices;

  for (AvatarJoint& joint : avatar->joints) joint.name = joint_name(joint.name, *naming);

  context.progress(0.7, "writing");
  const std::vector<std::byte> glb = write_glb(*avatar);
  if (auto ok = write_file(context.out / "avatar.glb", glb); !ok) return tl::unexpected(ok.error());
  context.progress(0.8, "writing VRM");
  const auto vrm = vrm_of(*avatar, *body, rest->vertices, *joints, context.options);
  if (!vrm) return tl::unexpected(vrm.error());
  if (auto ok = write_file(context.out / "avatar.vrm", *vrm); !ok) return tl::unexpected(ok.error());
  context.progress(0.9, "writing FBX");
  if (auto ok = write_file(context.out / "avatar.fbx", write_fbx(*avatar)); !ok) return tl::unexpected(ok.error());
  if (context.options.value("levels_of_detail", false))
    for (const auto& [name, share] : {std::pair("avatar-50.glb", 0.5), {"avatar-25.glb", 0.25}}) {
      context.progress(0.95, "writing levels of detail");
      const auto level = reduced(*avatar, share);
      if (!level) return tl::unexpected(level.error());
      if (auto ok = write_file(context.out / name, write_glb(*level)); !ok) return tl::unexpected(ok.error());
    }
  context.progress(1.0, "done");
  return nlohmann::json{{"bytes", glb.size()},
                        {"vertices", avatar->positions.size()},
                        {"triangles", avatar->triangles.size()},
                        {"joints", avatar->joints.size()},
                        {"expressions", avatar->morphs.size()},
                        {"built_in_template", body->built_in}};
}

}  // namespace

Stage avatar_stage() {
  Stage stage;
  stage.name = "avatar";
  stage.version = 2;
  stage.inputs = {"work/fit", "work/texture", "work/cameras/scene.json"};
  stage.external = {"template"};
  stage.options = {{"template", ""}, {"joint_names", "vrm"}, {"author", ""}, {"levels_of_detail", false}};
  stage.published = {"avatar.glb", "avatar.vrm", "avatar.fbx"};
  stage.estimate = {.parallel = false, .memory_gib = 0.5, .core_seconds = 10, .core_seconds_per_keyframe = 0};
  stage.run = run;
  return stage;
}

}  // namespace gyre
