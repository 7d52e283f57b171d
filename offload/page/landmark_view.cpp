// SPDX-License-Identifier: Apache-2.0
#include "offload/page/landmark_view.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "offload/body/landmark_set.h"
#include "offload/landmarks/picked_points.h"

#include <cmath>
#include <numbers>

namespace gyre {

namespace {

using nlohmann::json;

// How far around the subject a camera stands, 0: where it faces, degrees in (-180, 180].
double azimuth_deg(const Pose& cam_from_world, double yaw) {
  const Eigen::Vector3d centre = cam_from_world.inverse().translation;
  const double angle = std::atan2(centre.x(), centre.z()) - yaw;
  return std::remainder(angle, 2 * std::numbers::pi) * 180.0 / std::numbers::pi;
}

json frame_view(const ModelImage& image, const Camera& camera, const LandmarkSet& set) {
  json pixels = json::object();
  for (const PlacedLandmark& mark : set.placed) {
    const auto pixel = camera.project(image.cam_from_world * mark.position);
    if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < camera.width && pixel->y() < camera.height) {
      pixels[mark.name] = {pixel->x(), pixel->y()};
    }
  }
  return {{"name", image.name},
          {"width", camera.width},
          {"height", camera.height},
          {"azimuth_deg", set.yaw ? json(azimuth_deg(image.cam_from_world, *set.yaw)) : json()},
          {"pixels", std::move(pixels)}};
}

}  // namespace

std::filesystem::path picked_file(const Bundle& bundle) {
  return bundle.root() / "picked.json";
}

json landmark_view(const Bundle& bundle) {
  const Result<LandmarkSet> read = read_landmarks(bundle.work("landmarks") / "landmarks.json");
  const LandmarkSet set = read ? *read : LandmarkSet{};
  json view = {{"names", landmark_names()},
               {"placed", json::object()},
               {"missing", json::object()},
               {"picked", json::object()},
               {"frames", json::array()}};
  for (const PlacedLandmark& mark : set.placed) view["placed"][mark.name] = mark.source;
  for (const auto& [name, why] : set.missing) view["missing"][name] = why;
  std::error_code error;
  if (std::filesystem::exists(picked_file(bundle), error)) {
    if (const auto picked = read_picked(picked_file(bundle)); picked) {
      view["picked"] = to_json(*picked).at("landmarks");
    }
  }
  const Result<ColmapModel> model = read_colmap_model(bundle.work("cameras"));
  if (!model) return view;
  for (const auto& [id, image] : model->images) {
    view["frames"].push_back(frame_view(image, model->camera_of(image), set));
  }
  return view;
}

Result<void> keep_picked(const Bundle& bundle, const json& picked) {
  const auto points = picked_from_json(picked);
  if (!points) return tl::unexpected(points.error());
  if (!points->empty()) return write_file(picked_file(bundle), to_json(*points).dump(2) + "\n");
  std::error_code error;
  std::filesystem::remove(picked_file(bundle), error);
  if (error) return fail("cannot remove the picked points", picked_file(bundle).string());
  return {};
}

}  // namespace gyre
