// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/camera_scores.h"

#include "common/bundle/atomic_file.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace gyre::bench {

namespace {

using nlohmann::json;

Pose pose_of(const json& rows) {
  Eigen::Matrix4d m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c));
  return {Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())).normalized(), m.topRightCorner<3, 1>()};
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

}  // namespace

Result<TrueCameras> read_true_cameras(const std::filesystem::path& folder, const Bundle& bundle) {
  TrueCameras truth;
  if (std::filesystem::exists(folder / "cameras.txt")) {
    const auto model = read_colmap_model(folder);
    if (!model) return tl::unexpected<Error>(model.error());
    truth.camera = model->cameras.begin()->second;
    const auto frames = list_frames(bundle);
    if (!frames) return tl::unexpected<Error>(frames.error());
    // Keyframes of a folder of photographs are numbered in the order of their file names.
    std::map<std::string, Pose> by_name;
    for (const auto& [id, image] : model->images) by_name[image.name] = image.cam_from_world;
    std::size_t next = 0;
    for (const auto& [name, pose] : by_name)
      if (next < frames->size()) {
        const FrameId& id = (*frames)[next++];
        truth.cam_from_world[frame_name(id.pass, id.index)] = pose;
      }
    return truth;
  }
  for (const std::string pass : {"body", "head"}) {
    const auto text = read_file(folder / ("orbit-" + pass) / "truth.json");
    if (!text) continue;
    const json document = json::parse(*text);
    for (const json& frame : document.at("frames"))
      truth.cam_from_world[frame_name(pass, frame.at("index"))] = pose_of(frame.at("cam_from_world"));
    if (const auto camera = camera_from_json(document.at("camera"))) truth.camera = *camera;
  }
  if (truth.cam_from_world.empty()) return fail("no truth found", folder.string());
  return truth;
}

Result<CameraScores> score_cameras(const ColmapModel& found, const TrueCameras& truth) {
  std::vector<Eigen::Vector3d> true_centres, centres;
  std::vector<std::pair<Eigen::Quaterniond, Eigen::Quaterniond>> rotations;  // true, found
  for (const auto& [id, image] : found.images) {
    const auto known = truth.cam_from_world.find(image.name);
    if (known == truth.cam_from_world.end()) continue;
    true_centres.push_back(centre_of(known->second));
    centres.push_back(centre_of(image.cam_from_world));
    rotations.emplace_back(known->second.rotation, image.cam_from_world.rotation);
  }
  const auto truth_from_found = align_points(true_centres, centres);
  if (!truth_from_found) return tl::unexpected<Error>(truth_from_found.error());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& c : true_centres) middle += c / static_cast<double>(true_centres.size());
  CameraScores scores;
  std::vector<double> errors, angles, shares;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const double error = (*truth_from_found * centres[i] - true_centres[i]).norm();
    errors.push_back(error);
    shares.push_back(error / (true_centres[i] - middle).norm());
    if (error > 0.05) ++scores.misplaced;
    const Eigen::Quaterniond in_truth = rotations[i].second * truth_from_found->rotation.conjugate();
    angles.push_back(angle_between(rotations[i].first, in_truth));
  }
  scores.compared = static_cast<int>(errors.size());
  scores.centre_median = quantile(errors, 0.5);
  scores.centre_p95 = quantile(errors, 0.95);
  scores.centre_max = quantile(errors, 1.0);
  scores.centre_median_of_radius = quantile(shares, 0.5);
  scores.rotation_median = quantile(angles, 0.5);
  scores.rotation_p95 = quantile(angles, 0.95);
  scores.scale = truth_from_found->scale;
  if (truth.camera) scores.focal_error = std::abs(found.cameras.begin()->second.fx / truth.camera->fx - 1);
  return scores;
}

void print_figure(const std::string& bench, const std::string& name, const std::string& metric, double value,
                  const std::string& unit) {
  std::puts(
      json{{"bench", bench}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}}.dump().c_str());
  std::fflush(stdout);
}

void print_scores(const std::string& name, const CameraScores& scores) {
  constexpr double degrees = 57.29577951308232;
  const auto print = [&](const char* metric, double value, const char* unit) {
    print_figure("cameras", name, metric, value, unit);
  };
  print("compared", scores.compared, "cameras");
  print("misplaced", scores.misplaced, "cameras");
  print("centre_median", 1000 * scores.centre_median, "mm");
  print("centre_p95", 1000 * scores.centre_p95, "mm");
  print("centre_max", 1000 * scores.centre_max, "mm");
  print("centre_median_of_radius", 100 * scores.centre_median_of_radius, "percent");
  print("rotation_median", degrees * scores.rotation_median, "deg");
  print("rotation_p95", degrees * scores.rotation_p95, "deg");
  print("focal_error", 100 * scores.focal_error, "percent");
}

}  // namespace gyre::bench
