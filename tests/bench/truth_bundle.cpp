// SPDX-License-Identifier: Apache-2.0
// Makes a bundle whose cameras are the true ones, so that a later stage can be measured alone.
//
//   truth_bundle OUT KEYFRAMES_PER_PASS CAPTURE_DIR...     (a folder with truth.json and video.mp4; "head" in its name:
//   pass head)
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/bundle/ulid.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh_io.h"
#include "tests/bench/true_pose.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

namespace {

using nlohmann::json;

int fail_with(const std::string& text) {
  std::fprintf(stderr, "truth_bundle: %s\n", text.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return fail_with("usage: truth_bundle OUT KEYFRAMES_PER_PASS CAPTURE_DIR...");
  const std::size_t wanted = std::stoul(argv[2]);
  gyre::Scan scan;
  scan.id = gyre::new_ulid();
  scan.device = "truth";
  const gyre::Bundle bundle(argv[1]);
  std::filesystem::create_directories(bundle.frames());
  std::filesystem::create_directories(bundle.work("cameras"));
  gyre::ColmapModel model;
  std::vector<gyre::FrameRecord> records;
  bool turn = false;
  Eigen::AlignedBox3d box;
  for (int a = 3; a < argc; ++a) {
    const std::filesystem::path folder = argv[a];
    const std::string name = folder.lexically_normal().filename().string();
    const std::string pass = name.find("head") != std::string::npos ? "head" : name == "turn" ? "turn" : "body";
    turn = turn || pass == "turn";
    const auto text = gyre::read_file(folder / "truth.json");
    if (!text) return fail_with(text.error().message());
    const json truth = json::parse(*text);
    scan.height_mm = 1000.0 * truth.at("subject_info").at("height_m").get<double>();
    auto camera = gyre::camera_from_json(truth.at("camera"));
    if (!camera) return fail_with(camera.error().message());
    model.cameras[1] = *camera;
    std::vector<int> sharp;
    for (const json& f : truth.at("frames")) {
      if (!f.at("blurred").get<bool>() && !f.at("defocused").get<bool>() && !f.at("stopped").get<bool>())
        sharp.push_back(f.at("index"));
    }
    std::vector<int> chosen;
    for (std::size_t k = 0; k < std::min(wanted, sharp.size()); ++k)
      chosen.push_back(sharp[k * sharp.size() / std::min(wanted, sharp.size())]);
    cv::VideoCapture video((folder / "video.mp4").string());
    cv::Mat image;
    for (int index = 0; video.read(image); ++index) {
      if (!std::binary_search(chosen.begin(), chosen.end(), index)) continue;
      cv::imwrite(bundle.frame(pass, index).string(), image, {cv::IMWRITE_JPEG_QUALITY, 95});
      gyre::ModelImage entry;
      entry.name = gyre::frame_name(pass, index);
      entry.cam_from_world = gyre::bench::true_pose(truth.at("frames")[index]);
      model.images[static_cast<int>(model.images.size()) + 1] = entry;
      records.push_back({.pass = pass,
                         .index = index,
                         .time = truth.at("frames")[index].at("time"),
                         .decision = "keyframe",
                         .reason = "truth"});
    }
    scan.passes.push_back({pass, truth.at("fps"), truth.at("frame_count"), camera->width, camera->height});
    const auto mesh = gyre::read_ply(folder / "mesh.ply");
    if (!mesh) return fail_with(mesh.error().message());
    for (const Eigen::Vector3d& v : mesh->vertices) box.extend(v);
  }
  constexpr double margin = 0.1;
  const auto corner = [](const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); };
  const json scene = {
      {"scale_source", "height"},
      {"motion", turn ? "turn" : "orbit"},
      {"height_mm", scan.height_mm.value_or(0.0)},
      {"registered", model.images.size()},
      {"total", model.images.size()},
      {"box", {{"min", corner(box.min().array() - margin)}, {"max", corner(box.max().array() + margin)}}}};
  for (const auto& written : {gyre::write_scan(bundle, scan), gyre::write_frame_log(bundle, records),
                              gyre::write_colmap_model(model, bundle.work("cameras")),
                              gyre::write_file(bundle.work("cameras") / "scene.json", scene.dump(2))}) {
    if (!written) return fail_with(written.error().message());
  }
  return 0;
}
