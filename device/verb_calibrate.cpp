// SPDX-License-Identifier: Apache-2.0
#include "common/board/board.h"
#include "common/board/board_pdf.h"
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "common/selection/ingest.h"
#include "device/calibration/calibration_file.h"
#include "device/calibration/view_collector.h"
#include "device/camera/camera_device.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

namespace {

using nlohmann::json;

struct CalibrateFlags {
  std::string board_pdf;
  std::string paper = "a4";
  std::string pictures;
  std::string camera;
  std::string cameras = cameras_folder().string();
  double patience_s = 180.0;
};

Result<json> write_board(const CalibrateFlags& given) {
  // Files are written under another name and renamed, which would take the place of a printer's device.
  std::error_code absent;
  const auto there = std::filesystem::status(given.board_pdf, absent);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
    return wrong_use("not a file", given.board_pdf, "name the PDF file to write");
  const std::string pdf = board_pdf(given.paper == "a4" ? Paper::a4 : Paper::letter);
  if (const Result<void> written = write_file(given.board_pdf, pdf); !written) return tl::unexpected(written.error());
  return json{{"board_pdf", std::filesystem::absolute(given.board_pdf).string()},
              {"board", board_version},
              {"paper", given.paper}};
}

// The image of a live camera's frame may be a small one.
Result<BoardView> board_in(const Frame& frame) {
  const Result<std::string> jpeg = keyframe_jpeg(frame);
  if (!jpeg) return tl::unexpected(jpeg.error());
  const cv::Mat bytes(1, static_cast<int>(jpeg->size()), CV_8U, const_cast<char*>(jpeg->data()));
  const cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  return picture.empty() ? BoardView() : find_board(picture);
}

// Every picture of a folder, or of a recording that was made for this.
Result<std::vector<BoardView>> views_of_pictures(CameraDevice& camera) {
  const Progress progress = terminal_progress("looking for the board");
  const int expected = std::max(1, camera.info().expected_frames);
  std::vector<BoardView> views;
  for (int count = 0;;) {
    const Result<CameraEvent> event = camera.next(std::chrono::seconds(10));
    if (!event) return tl::unexpected(event.error());
    if (event->kind != CameraEvent::Kind::frame) return views;
    views.push_back(find_board(event->frame->image));
    progress(std::min(1.0, static_cast<double>(++count) / expected), "pictures");
  }
}

// What a person shows to a camera, until it is enough or the time is over.
Result<std::vector<BoardView>> views_of_camera(CameraDevice& camera, double patience_s) {
  using Clock = std::chrono::steady_clock;
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
  const Progress progress = terminal_progress("calibrating");
  ViewCollector collector(camera.info().width, camera.info().height);
  while (!collector.is_enough() && Clock::now() < end) {
    const Result<CameraEvent> event = camera.next(std::chrono::seconds(1));
    if (!event) return tl::unexpected(event.error());
    if (event->kind == CameraEvent::Kind::ended) break;
    if (event->kind == CameraEvent::Kind::timeout) continue;
    const Result<BoardView> view = board_in(*event->frame);
    if (!view) return tl::unexpected(view.error());
    collector.add(*view);
    progress(collector.fraction(), collector.advice());
  }
  return collector.views();
}

Result<json> calibrate_lens(const CalibrateFlags& given) {
  const std::string source = given.pictures.empty() ? given.camera : "replay:" + given.pictures;
  if (!given.camera.empty()) {
    if (const auto file = calibration_file(given.cameras, given.camera); !file) return tl::unexpected(file.error());
  }
  const Result<std::unique_ptr<CameraDevice>> opened = open_camera(source, Pace::fast);
  if (!opened) return tl::unexpected(opened.error());
  CameraDevice& camera = **opened;
  if (const Result<void> started = camera.start(); !started) return tl::unexpected(started.error());
  const Result<std::vector<BoardView>> views =
      camera.info().live ? views_of_camera(camera, given.patience_s) : views_of_pictures(camera);
  camera.stop();
  if (!views) return tl::unexpected(views.error());
  const Result<Calibration> found = calibrate_camera(*views, camera.info().width, camera.info().height);
  if (!found) return tl::unexpected(found.error());
  json line = {{"camera", given.camera.empty() ? json() : json(given.camera)},
               {"model", to_json(found->camera)},
               {"views", found->views},
               {"reprojection_error_px", found->error},
               {"covered", found->covered},
               {"focal_deviation", found->focal_deviation},
               {"kept", nullptr}};
  if (given.camera.empty()) {
    spdlog::warn("not kept: name the camera that took the pictures with --camera");
    return line;
  }
  if (const auto kept = write_calibration(given.cameras, given.camera, *found); !kept)
    return tl::unexpected(kept.error());
  line["kept"] = calibration_file(given.cameras, given.camera)->string();
  return line;
}

int calibrate(const CalibrateFlags& given) {
  const bool has_lens = !given.pictures.empty() || !given.camera.empty();
  if (given.board_pdf.empty() && !has_lens) {
    return report_error(wrong_use("nothing to do", "", "give --board-pdf, --pictures or --camera").value());
  }
  if (!given.board_pdf.empty()) {
    const Result<json> line = write_board(given);
    if (!line) return report_error(line.error());
    std::printf("%s\n", line->dump().c_str());
  }
  if (!has_lens) return 0;
  const Result<json> line = calibrate_lens(given);
  if (!line) return report_error(line.error());
  std::printf("%s\n", line->dump().c_str());
  return 0;
}

}  // namespace

void add_calibrate_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<CalibrateFlags>();
  CLI::App* verb = app.add_subcommand(
      "calibrate", "find the lens of a camera from the printed board; write the board, to be printed");
  verb->add_option("--board-pdf", flags->board_pdf, "PDF file to write the board to; replaced when it is there");
  verb->add_option("--paper", flags->paper, "paper it will be printed on")
      ->check(CLI::IsMember({"a4", "letter"}))
      ->capture_default_str();
  verb->add_option("--camera", flags->camera,
                   "camera to calibrate; its scans use what is found. Shows live what to do with the board");
  verb->add_option("--pictures", flags->pictures,
                   "folder with pictures of the board that the camera took, or a video, instead of live ones");
  verb->add_option("--patience-s", flags->patience_s, "how long a live camera looks for views of the board, seconds")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  verb->add_option("--cameras", flags->cameras, "folder where calibrations are kept")->capture_default_str();
  verb->callback([flags, &run] { run = [flags] { return calibrate(*flags); }; });
}

}  // namespace gyre
