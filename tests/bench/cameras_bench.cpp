// SPDX-License-Identifier: Apache-2.0
// Measures the `cameras` stage of a bundle against true cameras, one JSON line per figure.
//
//   cameras_bench BUNDLE TRUTH_DIR [THREADS]   TRUTH_DIR: a subject's folder with orbit-body/ and orbit-head/ in it
//                                              (truth.json, metres), or the folder of a COLMAP text model
#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "offload/cameras/cameras_stage.h"

#include <ctime>

namespace {

using nlohmann::json;

struct Truth {
  std::map<std::string, gyre::Pose> cam_from_world;  // by keyframe name
  std::optional<gyre::Camera> camera;
};

gyre::Pose pose_of(const json& rows) {
  Eigen::Matrix4d m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c));
  return {Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())).normalized(), m.topRightCorner<3, 1>()};
}

gyre::Result<Truth> read_truth(const std::filesystem::path& folder, const gyre::Bundle& bundle) {
  Truth truth;
  if (std::filesystem::exists(folder / "cameras.txt")) {
    const auto model = gyre::read_colmap_model(folder);
    if (!model) return tl::unexpected<gyre::Error>(model.error());
    truth.camera = model->cameras.begin()->second;
    const auto frames = gyre::list_frames(bundle);
    if (!frames) return tl::unexpected<gyre::Error>(frames.error());
    // Keyframes of a folder of photographs are numbered in the order of their file names.
    std::map<std::string, gyre::Pose> by_name;
    for (const auto& [id, image] : model->images) by_name[image.name] = image.cam_from_world;
    std::size_t next = 0;
    for (const auto& [name, pose] : by_name)
      if (next < frames->size()) {
        const gyre::FrameId& id = (*frames)[next++];
        truth.cam_from_world[gyre::frame_name(id.pass, id.index)] = pose;
      }
    return truth;
  }
  for (const std::string pass : {"body", "head"}) {
    const auto text = gyre::read_file(folder / ("orbit-" + pass) / "truth.json");
    if (!text) continue;
    const json document = json::parse(*text);
    for (const json& frame : document.at("frames"))
      truth.cam_from_world[gyre::frame_name(pass, frame.at("index"))] = pose_of(frame.at("cam_from_world"));
    if (const auto camera = gyre::camera_from_json(document.at("camera"))) truth.camera = *camera;
  }
  if (truth.cam_from_world.empty()) return gyre::fail("no truth found", folder.string());
  return truth;
}

void print(const std::string& name, const char* metric, double value, const char* unit) {
  std::puts(
      json{{"bench", "cameras"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}}.dump().c_str());
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

int fail_with(const std::string& text) {
  std::fprintf(stderr, "cameras_bench: %s\n", text.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return fail_with("usage: cameras_bench BUNDLE TRUTH_DIR [THREADS]");
  const gyre::Bundle bundle(argv[1]);
  const auto truth = read_truth(argv[2], bundle);
  if (!truth) return fail_with(truth.error().message());
  const std::filesystem::path out = std::filesystem::temp_directory_path() / "gyre-cameras-bench";
  std::filesystem::create_directories(out);
  const gyre::Stage stage = gyre::cameras_stage();
  gyre::StageContext context{.bundle = bundle, .out = out, .options = stage.options};
  if (argc > 3) context.threads = std::stoi(argv[3]);
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t cpu_begin = std::clock();
  const auto result = stage.run(context);
  if (!result) return fail_with(result.error().message());
  const std::string name = bundle.root().filename().string();
  print(name, "wall", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), "s");
  print(name, "cpu", static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC, "s");

  const auto model = gyre::read_colmap_model(out);
  if (!model) return fail_with(model.error().message());
  std::filesystem::remove_all(out);
  std::vector<Eigen::Vector3d> true_centres, centres;
  std::vector<std::pair<Eigen::Quaterniond, Eigen::Quaterniond>> rotations;  // true, found
  for (const auto& [id, image] : model->images) {
    const auto found = truth->cam_from_world.find(image.name);
    if (found == truth->cam_from_world.end()) continue;
    true_centres.push_back(gyre::centre_of(found->second));
    centres.push_back(gyre::centre_of(image.cam_from_world));
    rotations.emplace_back(found->second.rotation, image.cam_from_world.rotation);
  }
  const auto truth_from_model = gyre::align_points(true_centres, centres);
  if (!truth_from_model) return fail_with(truth_from_model.error().message());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& c : true_centres) middle += c / static_cast<double>(true_centres.size());
  std::vector<double> centre_mm, rotation_deg, shares;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const double error = (*truth_from_model * centres[i] - true_centres[i]).norm();
    centre_mm.push_back(1000 * error);
    shares.push_back(100 * error / (true_centres[i] - middle).norm());
    const Eigen::Quaterniond in_truth = rotations[i].second * truth_from_model->rotation.conjugate();
    rotation_deg.push_back(gyre::angle_between(rotations[i].first, in_truth) * 57.29577951308232);
  }
  print(name, "registered", (*result)["registered"].get<double>() / (*result)["total"].get<double>(), "share");
  print(name, "centre_median", quantile(centre_mm, 0.5), "mm");
  print(name, "centre_p95", quantile(centre_mm, 0.95), "mm");
  print(name, "centre_max", quantile(centre_mm, 1.0), "mm");
  print(name, "centre_median_of_radius", quantile(shares, 0.5), "percent");
  print(name, "rotation_median", quantile(rotation_deg, 0.5), "deg");
  print(name, "rotation_p95", quantile(rotation_deg, 0.95), "deg");
  print(name, "scale_error", 100 * std::abs(truth_from_model->scale - 1), "percent");
  if (truth->camera)
    print(name, "focal_error", 100 * std::abs(model->cameras.begin()->second.fx / truth->camera->fx - 1), "percent");
  return 0;
}
