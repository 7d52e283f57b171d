// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_stage.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "offload/cloud/dense_cloud.h"

#include <chrono>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

struct SceneFacts {
  SubjectRegion region;
  bool turn = false;     // the camera was fixed
  double stature = 0.0;  // of the subject, metres, where the scale of the world rests on it; else 0
};

Result<SceneFacts> read_scene(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const nlohmann::json scene = nlohmann::json::parse(*text, nullptr, false);
  const std::string remedy = "run the cameras stage again";
  try {
    SceneFacts facts;
    SubjectRegion& region = facts.region;
    for (int axis = 0; axis < 3; ++axis) {
      region.min[axis] = scene.at("box").at("min").at(axis).get<double>();
      region.max[axis] = scene.at("box").at("max").at(axis).get<double>();
    }
    // Comparisons with NaN are false, so this refuses it too.
    if (!(region.min.array() < region.max.array()).all())
      return fail("the subject's box is empty", file.string(), remedy);
    facts.turn = scene.value("motion", "orbit") == "turn";
    const std::string source = scene.value("scale_source", "");
    if (source == "height" || source == "assumed-height") facts.stature = 1e-3 * scene.at("height_mm").get<double>();
    return facts;
  } catch (const nlohmann::json::exception&) {
    return fail("no box of the subject in the scene, or no height", file.string(), remedy);
  }
}

Result<DenseCloudOptions> read_options(const StageContext& ctx) {
  DenseCloudOptions options;
  try {
    options.long_side = ctx.options.at("long_side_px").get<int>();
    options.selection.count = ctx.options.at("neighbours").get<int>();
    options.consistency.min_views = ctx.options.at("min_views").get<int>();
    options.voxel = 1e-3 * ctx.options.at("spacing_mm").get<double>();
    options.max_points = ctx.options.at("max_points").get<std::size_t>();
  } catch (const nlohmann::json::exception& e) {
    return wrong_use("an option of stage cloud is missing or of the wrong type", e.what());
  }
  options.memory_gib = ctx.memory_gib;
  options.threads = ctx.threads;
  options.seed = ctx.seed;
  if (const auto valid = options.check(); !valid) return tl::unexpected(valid.error());
  return options;
}

nlohmann::json facts_of(const DenseCloud& dense, std::size_t views) {
  nlohmann::json facts = {{"points", dense.cloud.points.size()},
                          {"height_m", dense.height},
                          {"views", views},
                          {"views_used", dense.views_used},
                          {"views_left_out", dense.left_out},
                          {"coverage", summary_of(dense.coverage)},
                          {"depth_mpx", dense.megapixels},
                          {"depth_cpu_seconds", dense.cpu_seconds},
                          {"mpx_per_cpu_second", dense.megapixels / std::max(dense.cpu_seconds, 1e-9)}};
  for (const auto& [step, seconds] : dense.seconds) facts["seconds"][step] = seconds;
  return facts;
}

// The cameras stage lays the scale so that the highest of its few points is the subject's stature; the cloud, which has
// the crown, knows better by how much lengths are wrong. It stays in the world of the cameras all the same, or pictures
// and surface would no longer fit together: true lengths are those of the bundle times `correction`.
nlohmann::json scale_of(const DenseCloud& dense, double stature) {
  return {{"stature_m", stature},
          {"correction", stature / dense.height},
          {"uncertainty", dense.height_deviation / dense.height}};
}

Result<nlohmann::json> run(const StageContext& ctx) {
  auto options = read_options(ctx);
  if (!options) return tl::unexpected(options.error());
  const std::filesystem::path cameras = ctx.bundle.work("cameras");
  if (!std::filesystem::exists(cameras / "images.txt")) {
    return fail("there are no cameras yet", cameras.string(), "run the cameras stage first");
  }
  auto model = read_colmap_model(cameras);
  if (!model) return tl::unexpected(model.error());
  model->remove_images_without_points();
  const auto scene = read_scene(cameras / "scene.json");
  if (!scene) return tl::unexpected(scene.error());
  options->turn = scene->turn;
  if (model->images.size() < 3) {
    return fail("dense stereo needs at least 3 registered views", std::to_string(model->images.size()) + " are there",
                "capture more overlapping views");
  }

  const auto start = std::chrono::steady_clock::now();
  const auto views = load_views(*model, ctx.bundle.frames(), *options, ctx.progress);
  if (!views) return tl::unexpected(views.error());
  const std::chrono::duration<double> loading = std::chrono::steady_clock::now() - start;
  const auto dense = build_cloud(*views, scene->region, *options, ctx.progress);
  if (!dense) return tl::unexpected(dense.error());

  nlohmann::json facts = facts_of(*dense, views->size());
  facts["seconds"]["loading"] = loading.count();
  const bool has_crown = dense->coverage.crown.points > 0 && dense->coverage.crown.hole == HoleKind::none;
  if (scene->stature > 0 && has_crown) facts["scale"] = scale_of(*dense, scene->stature);
  if (const auto wrote = write_cloud(dense->cloud, ctx.out / "cloud.ply"); !wrote) return tl::unexpected(wrote.error());
  if (const auto wrote = write_file(ctx.out / "cloud.json", facts.dump(2) + "\n"); !wrote) {
    return tl::unexpected(wrote.error());
  }
  const std::string coverage = to_json(dense->coverage).dump(2) + "\n";
  if (const auto wrote = write_file(ctx.out / "coverage.json", coverage); !wrote) return tl::unexpected(wrote.error());
  ctx.progress(1.0, "cloud written");
  return facts;
}

}  // namespace

Stage cloud_stage() {
  Stage stage;
  stage.name = "cloud";
  stage.version = 3;
  stage.inputs = {"frames", "work/cameras"};
  stage.options = {
      {"long_side_px", 640}, {"neighbours", 8}, {"min_views", 3}, {"spacing_mm", 2.0}, {"max_points", 1000000}};
  stage.estimate = {
      .memory_gib = 0.5, .memory_gib_per_keyframe = 0.009, .core_seconds = 40, .core_seconds_per_keyframe = 3};
  stage.run = run;
  return stage;
}

}  // namespace gyre
