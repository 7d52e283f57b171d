// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/fit_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/template.h"
#include "offload/fit/person_fit.h"

#include <numbers>

namespace gyre {

namespace {

nlohmann::json numbers(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

nlohmann::json fit_json(const BodyTemplate& body, const PersonFit& fit) {
  constexpr double degrees = 180.0 / std::numbers::pi;
  nlohmann::json json;
  json["template"] = {{"name", body.name}, {"checksum", body.checksum}, {"built_in", body.built_in}};
  json["translation"] = numbers(fit.pose.translation);
  json["rotations"] = nlohmann::json::array();
  for (const Eigen::Vector3d& rotation : fit.pose.rotations) json["rotations"].push_back(numbers(rotation));
  json["shape"] = numbers(fit.state.shape);
  json["scale"] = fit.state.scale;
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    const std::string& name = body.joints[j].name;
    json["joints"][name] = numbers(fit.posed_from_rest[j] * fit.rest_joints[j]);
    json["rest_joints"][name] = numbers(fit.rest_joints[j]);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = fit.posed_from_rest[j].matrix();
    json["joint_transforms"][name] = std::vector<double>(matrix.data(), matrix.data() + 16);
  }
  json["residual_mm"] = {{"mean", 1000 * fit.residual_mean}, {"p95", 1000 * fit.residual_p95}};
  json["yaw_deg"] = degrees * yaw_of(fit.pose);
  json["stature_mm"] = 1000 * fit.stature;
  json["facing"] = nlohmann::json::array();
  for (const FacingGuess& guess : fit.guesses)
    json["facing"].push_back({{"yaw_deg", degrees * guess.yaw},
                              {"misfit_mm", 1000 * guess.misfit},
                              {"toes_forward", guess.toes},
                              {"cost_mm", 1000 * guess.cost}});
  json["support"] = fit.support;
  json["warnings"] = fit.warnings;
  return json;
}

// False when the cameras stage had to assume the subject's height.
Result<bool> is_metric(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const nlohmann::json scene = nlohmann::json::parse(*text, nullptr, false);
  if (!scene.is_object())
    return fail("the scene description is not valid JSON", file.string(), "run the stage cameras");
  return scene.value("scale_source", "assumed-height") != "assumed-height";
}

Result<nlohmann::json> run_fit(const StageContext& context) {
  const auto body = find_template(context.options.value("template", std::string()));
  if (!body) return tl::unexpected(body.error());
  const auto cloud = read_cloud(context.bundle.work("cloud") / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  const auto metric = is_metric(context.bundle.work("cameras") / "scene.json");
  if (!metric) return tl::unexpected(metric.error());

  PersonFitOptions options;
  options.metric = *metric;
  options.threads = context.threads;
  const auto fit = fit_person(*body, *cloud, options, context.progress);
  if (!fit) return tl::unexpected(fit.error());
  for (const std::string& warning : fit->warnings) spdlog::warn("{}", warning);

  TriangleMesh mesh;
  mesh.triangles = body->mesh.triangles;
  mesh.vertices = fit->vertices;
  mesh.normals = vertex_normals(mesh.vertices, mesh.triangles);
  if (auto written = write_ply(mesh, context.out / "posed.ply"); !written) return tl::unexpected(written.error());
  mesh.vertices = fit->rest_vertices;
  mesh.normals = vertex_normals(mesh.vertices, mesh.triangles);
  if (auto written = write_ply(mesh, context.out / "rest.ply"); !written) return tl::unexpected(written.error());
  const nlohmann::json json = fit_json(*body, *fit);
  if (auto written = write_file(context.out / "fit.json", json.dump(1)); !written)
    return tl::unexpected(written.error());
  return nlohmann::json{{"template", json["template"]}, {"residual_mm", json["residual_mm"]},
                        {"yaw_deg", json["yaw_deg"]},   {"stature_mm", json["stature_mm"]},
                        {"facing", json["facing"]},     {"support", json["support"]},
                        {"warnings", json["warnings"]}};
}

}  // namespace

Stage fit_stage() {
  Stage stage;
  stage.name = "fit";
  stage.inputs = {"work/cloud/cloud.ply", "work/cameras/scene.json"};
  stage.external = {"template"};
  stage.options = {{"template", ""}};
  stage.run = run_fit;
  return stage;
}

}  // namespace gyre
