// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/landmarks_stage.h"

#include "common/mesh/mesh_io.h"
#include "offload/landmarks/geometric_detector.h"
#include "offload/landmarks/merge.h"
#include "offload/landmarks/network_detector.h"
#include "offload/landmarks/picked_points.h"
#include "offload/landmarks/subject.h"

#include <numbers>

namespace gyre {

namespace {

using nlohmann::json;

Result<std::vector<LandmarkView>> read_views(const Bundle& bundle) {
  auto model = read_colmap_model(bundle.work("cameras"));
  if (!model) return tl::unexpected(model.error());
  model->remove_images_without_points();
  std::vector<LandmarkView> views;
  for (const auto& [id, image] : model->images)
    views.push_back({image.name, model->camera_of(image), image.cam_from_world, bundle.frames() / image.name});
  return views;
}

Result<KeypointNetworkOptions> read_network_options(const json& options) {
  KeypointNetworkOptions network;
  try {
    network.layout = options.at("network_layout").get<std::string>();
    network.width = options.at("network_width_px").get<int>();
    network.height = options.at("network_height_px").get<int>();
    network.mean = options.at("network_mean").get<std::array<double, 3>>();
    network.deviation = options.at("network_deviation").get<std::array<double, 3>>();
    network.rgb = options.at("network_rgb").get<bool>();
  } catch (const json::exception& e) {
    return wrong_use("an option of stage landmarks is missing or of the wrong type", e.what());
  }
  if (const auto valid = network.check(); !valid) return tl::unexpected(valid.error());
  return network;
}

// Geometry always; a network and picked points when given.
Result<std::vector<std::unique_ptr<LandmarkDetector>>> make_detectors(const json& options) {
  std::vector<std::unique_ptr<LandmarkDetector>> detectors;
  detectors.push_back(std::make_unique<GeometricDetector>());
  if (const std::string file = options.value("network", ""); !file.empty()) {
    const auto network_options = read_network_options(options);
    if (!network_options) return tl::unexpected(network_options.error());
    auto network = KeypointNetwork::load(file, *network_options);
    if (!network) return tl::unexpected(network.error());
    detectors.push_back(std::make_unique<NetworkDetector>(std::move(*network)));
  }
  if (const std::string file = options.value("picked", ""); !file.empty()) {
    auto points = read_picked(file);
    if (!points) return tl::unexpected(points.error());
    detectors.push_back(std::make_unique<PickedDetector>(std::move(*points)));
  }
  return detectors;
}

json facts_of(const LandmarkSet& set) {
  json placed = json::object();
  for (const PlacedLandmark& mark : set.placed) placed[mark.source].push_back(mark.name);
  return {{"placed", placed},
          {"missing", set.missing},
          {"yaw_deg", set.yaw ? json(*set.yaw * 180 / std::numbers::pi) : json()},
          {"yaw_certainty", set.yaw_certainty},
          {"yaw_reasons", set.yaw_reasons}};
}

Result<json> run(const StageContext& context) {
  const auto detectors = make_detectors(context.options);
  if (!detectors) return tl::unexpected(detectors.error());
  auto cloud = read_cloud(context.bundle.work("cloud") / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  auto views = read_views(context.bundle);
  if (!views) return tl::unexpected(views.error());
  context.progress(0.05, "limbs and facing");
  const auto subject = make_subject(std::move(*cloud), std::move(*views));
  if (!subject) return tl::unexpected(subject.error());

  const auto set = detect_landmarks(*subject, *detectors, [&](double fraction, std::string_view what) {
    context.progress(0.3 + 0.7 * fraction, what);
  });
  if (!set) return tl::unexpected(set.error());
  if (auto written = write_landmarks(*set, context.out / "landmarks.json"); !written)
    return tl::unexpected(written.error());
  return facts_of(*set);
}

}  // namespace

Stage landmarks_stage() {
  Stage stage;
  stage.name = "landmarks";
  stage.version = 3;
  stage.inputs = {"work/cloud/cloud.ply", "work/cameras", "frames"};
  stage.external = {"picked", "network"};
  const KeypointNetworkOptions network;
  stage.options = {{"picked", ""},
                   {"network", ""},
                   {"network_layout", network.layout},
                   {"network_width_px", network.width},
                   {"network_height_px", network.height},
                   {"network_mean", network.mean},
                   {"network_deviation", network.deviation},
                   {"network_rgb", network.rgb}};
  stage.estimate = {.parallel = false, .memory_gib = 0.3, .core_seconds = 10, .core_seconds_per_keyframe = 0.05};
  stage.run = run;
  return stage;
}

}  // namespace gyre
