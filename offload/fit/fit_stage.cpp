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
  json["head"] = numbers(fit.state.head);
  json["scale"] = fit.state.scale;
  for (std::size_t j = 0; j < body.joints.size(); ++j) {
    const std::string& name = body.joints[j].name;
    json["joints"][name] = numbers(fit.posed_from_rest[j] * fit.rest_joints[j]);
    json["rest_joints"][name] = numbers(fit.rest_joints[j]);
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = fit.posed_from_rest[j].matrix();
    json["joint_transforms"][name] = std::vector<double>(matrix.data(), matrix.data() + 16);
  }
  json["residual_mm"] = {{"mean", 1000 * fit.quality.residual_mean}, {"p95", 1000 * fit.quality.residual_p95}};
  json["yaw_deg"] = degrees * yaw_of(fit.pose);
  json["stature_mm"] = 1000 * fit.stature;
  json["facing"] = nlohmann::json::array();
  for (const FacingGuess& guess : fit.guesses)
    json["facing"].push_back({{"yaw_deg", degrees * guess.yaw},
                              {"misfit_mm", 1000 * guess.misfit},
                              {"toes_forward", guess.toes},
                              {"cost_mm", 1000 * guess.cost}});
  json["support"] = fit.quality.support;
  json["prior_only"] = fit.quality.prior_only;
  for (const auto& [name, measure] : fit.measures)
    json["measures"][name] = {
        {"mm", 1000 * measure.value}, {"deviation_mm", 1000 * measure.deviation}, {"support", measure.support}};
  json["warnings"] = fit.warnings;
  return json;
}

// One entry a template vertex; null where the cloud has nothing.
nlohmann::json quality_json(const FitQuality& quality) {
  const auto rounded = [](double value, double unit) { return std::round(value / unit) * unit; };
  nlohmann::json json;
  json["residual_mm"] = nlohmann::json::array();
  json["confidence"] = nlohmann::json::array();
  for (std::size_t v = 0; v < quality.residual.size(); ++v) {
    json["residual_mm"].push_back(std::isfinite(quality.residual[v])
                                      ? nlohmann::json(rounded(1000 * quality.residual[v], 0.01))
                                      : nlohmann::json());
    json["confidence"].push_back(rounded(quality.confidence[v], 0.001));
  }
  json["prior_only"] = quality.prior_only;
  return json;
}

// What the cameras stage knows about the scale of the cloud.
struct Scale {
  bool metric = true;        // false: the subject's height had to be assumed
  double deviation = 0.005;  // relative
};

Result<Scale> read_scale(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const nlohmann::json scene = nlohmann::json::parse(*text, nullptr, false);
  if (!scene.is_object())
    return fail("the scene description is not valid JSON", file.string(), "run the stage cameras");
  Scale scale;
  if (const auto source = scene.find("scale_source"); source == scene.end() || !source->is_string()) {
    scale.metric = false;
  } else {
    scale.metric = *source != "assumed-height";
  }
  if (const auto deviation = scene.find("scale_uncertainty"); deviation != scene.end() && deviation->is_number())
    scale.deviation = std::clamp(deviation->get<double>(), 0.0, 1.0);
  return scale;
}

// None where that stage has not run: the fit then goes by the cloud alone.
Result<LandmarkSet> landmarks_of(const Bundle& bundle) {
  const std::filesystem::path file = bundle.work("landmarks") / "landmarks.json";
  if (!std::filesystem::exists(file)) return LandmarkSet{};
  return read_landmarks(file);
}

Result<nlohmann::json> run_fit(const StageContext& context) {
  const auto body = find_template(context.options.value("template", std::string()));
  if (!body) return tl::unexpected(body.error());
  const auto cloud = read_cloud(context.bundle.work("cloud") / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  const auto scale = read_scale(context.bundle.work("cameras") / "scene.json");
  if (!scale) return tl::unexpected(scale.error());

  const auto landmarks = landmarks_of(context.bundle);
  if (!landmarks) return tl::unexpected(landmarks.error());

  PersonFitOptions options;
  options.metric = scale->metric;
  options.scale_deviation = scale->deviation;
  options.threads = context.threads;
  const auto fit = fit_person(*body, *cloud, *landmarks, options, context.progress);
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
  if (auto written = write_file(context.out / "quality.json", quality_json(fit->quality).dump()); !written)
    return tl::unexpected(written.error());
  return nlohmann::json{
      {"template", json["template"]},     {"residual_mm", json["residual_mm"]}, {"yaw_deg", json["yaw_deg"]},
      {"stature_mm", json["stature_mm"]}, {"facing", json["facing"]},           {"support", json["support"]},
      {"prior_only", json["prior_only"]}, {"measures", json["measures"]},       {"warnings", json["warnings"]}};
}

}  // namespace

Stage fit_stage() {
  Stage stage;
  stage.name = "fit";
  stage.version = 3;
  stage.inputs = {"work/cloud/cloud.ply", "work/cameras/scene.json", "work/landmarks/landmarks.json"};
  stage.external = {"template"};
  stage.options = {{"template", ""}};
  stage.estimate = {.parallel = false, .memory_gib = 0.5, .core_seconds = 30, .core_seconds_per_keyframe = 0};
  stage.run = run_fit;
  return stage;
}

}  // namespace gyre
