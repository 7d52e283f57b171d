// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/avatar_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/avatar/avatar.h"
#include "offload/avatar/glb.h"

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

Result<nlohmann::json> run(const StageContext& context) {
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
  const auto texture = read_file(context.bundle.work("texture") / "albedo.png");
  if (!texture) return tl::unexpected(texture.error());

  context.progress(0.2, "assembling");
  auto avatar = assemble_avatar(*body, rest->vertices, *joints);
  if (!avatar) return tl::unexpected(avatar.error());
  const auto bytes_of_texture = std::as_bytes(std::span(*texture));
  avatar->texture.assign(bytes_of_texture.begin(), bytes_of_texture.end());
  avatar->texture_type = "image/png";
  avatar->facts = {{"template", body->name},
                   {"template_checksum", body->checksum},
                   {"built_in_template", body->built_in},
                   {"scale_source", scene->value("scale_source", "unknown")}};
  if (!body->notices.empty()) avatar->facts["notices"] = body->notices;

  context.progress(0.8, "writing");
  const std::vector<std::byte> glb = write_glb(*avatar);
  if (auto ok = write_file(context.out / "avatar.glb", glb); !ok) return tl::unexpected(ok.error());
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
  stage.inputs = {"work/fit", "work/texture", "work/cameras/scene.json"};
  stage.external = {"template"};
  stage.options = {{"template", ""}};
  stage.published = {"avatar.glb"};
  stage.run = run;
  return stage;
}

}  // namespace gyre
