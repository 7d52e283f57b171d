// SPDX-License-Identifier: Apache-2.0
#include "tests/system/rendered_bundle.h"

#include "common/bundle/atomic_file.h"
#include "common/geometry/colmap_model.h"
#include "common/parallel/parallel.h"
#include "offload/cameras/cameras_stage.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

synthetic::CaptureOptions small_walk() {
  synthetic::CaptureOptions options;
  options.frames = 60;
  options.fps = 1.0;  // of the keyframes: a walk of a minute
  options.stop = false;
  options.rush = false;
  return options;
}

RenderedBundle::RenderedBundle(double height_mm) {
  scan_.id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
  scan_.height_mm = height_mm;
  bundle_ = *create_bundle(folder_.path() / "scan", scan_);
}

void RenderedBundle::add(const std::string& pass, const synthetic::Capture& capture, std::vector<int> frames) {
  const synthetic::CaptureOptions& options = capture.options;
  if (frames.empty()) {
    frames.resize(static_cast<std::size_t>(options.frames));
    std::iota(frames.begin(), frames.end(), 0);
  }
  if (scan_.passes.empty() || scan_.passes.back().name != pass)
    scan_.passes.push_back({pass, options.fps, 0, options.width, options.height});
  int& count = scan_.passes.back().frame_count;
  parallel_for(frames.size(), 0, [&](std::size_t i) {
    cv::imwrite(bundle_.frame(pass, count + static_cast<int>(i)).string(), synthetic::render_frame(capture, frames[i]),
                {cv::IMWRITE_JPEG_QUALITY, 95});
  });
  for (const int frame : frames) truth_[frame_name(pass, count++)] = capture.frames[frame].cam_from_world;
  ASSERT_TRUE(write_scan(bundle_, scan_));
  // To look at what was rendered: GYRE_KEEP_FRAMES=folder.
  if (const char* keep = std::getenv("GYRE_KEEP_FRAMES"))
    std::filesystem::copy(bundle_.root(), keep,
                          std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
}

Result<nlohmann::json> run_stage(const Stage& stage, const RenderedBundle& rendered, const nlohmann::json& changed) {
  StageContext context{
      .bundle = rendered.bundle(), .out = rendered.bundle().work(stage.name), .options = stage.options};
  if (changed.is_object()) context.options.update(changed);
  std::filesystem::create_directories(context.out);
  return stage.run(context);
}

Result<CameraFigures> place_cameras(const RenderedBundle& rendered) {
  CameraFigures figures;
  const auto result = run_stage(cameras_stage(), rendered);
  if (!result) return tl::unexpected<Error>(result.error());
  figures.result = *result;
  const std::filesystem::path work = rendered.bundle().work("cameras");
  const auto text = read_file(work / "scene.json");
  if (!text) return tl::unexpected<Error>(text.error());
  figures.scene = nlohmann::json::parse(*text);
  const auto model = read_colmap_model(work);
  if (!model) return tl::unexpected<Error>(model.error());

  std::vector<Eigen::Vector3d> truth, found;
  for (const auto& [id, image] : model->images) {
    truth.push_back(centre_of(rendered.truth().at(image.name)));
    found.push_back(centre_of(image.cam_from_world));
  }
  const auto truth_from_world = align_points(truth, found);
  if (!truth_from_world) return tl::unexpected<Error>(truth_from_world.error());
  figures.truth_from_world = *truth_from_world;
  std::vector<double> errors;
  for (std::size_t i = 0; i < truth.size(); ++i)
    errors.push_back(1000 * (*truth_from_world * found[i] - truth[i]).norm());
  std::sort(errors.begin(), errors.end());
  figures.total = static_cast<int>(rendered.truth().size());
  figures.registered = static_cast<int>(errors.size());
  figures.median_mm = errors[errors.size() / 2];
  figures.largest_mm = errors.back();
  const Eigen::Vector3d origin = *truth_from_world * Eigen::Vector3d::Zero();
  figures.axis_mm = 1000 * std::hypot(origin.x(), origin.z());
  figures.floor_mm = 1000 * origin.y();
  const double up = (truth_from_world->rotation * Eigen::Vector3d::UnitY()).y();
  figures.tilt_deg = std::acos(std::min(1.0, up)) * 180 / M_PI;
  figures.scale_percent = 100 * (truth_from_world->scale - 1);
  return figures;
}

std::string to_text(const CameraFigures& f) {
  return fmt::format(
      "{} of {} registered, centres {:.1f} mm median, {:.1f} mm at most; axis {:.0f} mm off, up {:.2f} degrees, floor "
      "{:.0f} mm, scale {:+.2f} %; ring {}",
      f.registered, f.total, f.median_mm, f.largest_mm, f.axis_mm, f.tilt_deg, f.floor_mm, f.scale_percent,
      f.scene.value("ring", nlohmann::json()).dump());
}

}  // namespace gyre
