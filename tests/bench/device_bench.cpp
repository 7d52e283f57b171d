// SPDX-License-Identifier: Apache-2.0
// The device's analysis and coverage on the synthetic captures with known truth, as JSON lines: device_bench DATA
//
// Times are of the CPU, on one core, for pictures of the captures' size and flow at 180 x 320.
#include "common/bundle/bundle.h"
#include "common/geometry/pose.h"
#include "common/video/frame_source.h"
#include "device/coverage/coverage.h"
#include "device/guidance/guidance.h"
#include "device/session/observer.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <string>

namespace {

using namespace gyre;
namespace fs = std::filesystem;

constexpr double degrees = 180.0 / M_PI;

void line(const std::string& which, const char* metric, double value, const char* unit) {
  const nlohmann::ordered_json line = {
      {"bench", "device"}, {"case", which}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::puts(line.dump().c_str());
}

// Of this thread: the video is decoded by others meanwhile.
class Stopwatch {
 public:
  double milliseconds() const { return now() - start_; }

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  }
  double start_ = now();
};

Eigen::Vector3d true_centre(const nlohmann::json& m) {
  Eigen::Matrix4d cam_from_world;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) cam_from_world(r, c) = m[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }
  return -cam_from_world.topLeftCorner<3, 3>().transpose() * cam_from_world.topRightCorner<3, 1>();
}

struct Times {
  double farneback = 0, dis = 0, sharpness = 0, motion = 0, coverage = 0;
};

// has_turntable: of a turn, its angle is known.
Result<void> run(const fs::path& folder, const std::string& pass, bool has_turntable) {
  Result<std::unique_ptr<FrameSource>> source = open_capture(folder / "video.mp4");
  if (!source) return tl::unexpected(source.error());
  std::ifstream file(folder / "truth.json");
  const nlohmann::json truth = nlohmann::json::parse(file);
  const Result<Camera> lens = camera_from_json(truth.at("camera"));
  if (!lens) return tl::unexpected(lens.error());

  FocusWatch focus;
  CameraMotionEstimator motion(*lens);
  Coverage coverage(pass, *lens);
  Times times;
  std::vector<FrameMeasure> with_farneback, with_dis;
  std::vector<bool> truly_sharp;
  DenseFlow farneback, dis(FlowMethod::dis);
  double azimuth = 0.0, last = 0.0, worst = 0.0, at_closure = -1.0;
  double start_height = 0.0, start_elevation = 0.0;
  int frames = 0, right_band = 0, unknown = 0;
  CoverageReading reading;
  Observer observer(pass, true);
  Guidance guidance;
  std::array<int, condition_count> raised{};
  for (;;) {
    const Result<std::optional<Frame>> frame = (*source)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    const nlohmann::json& now = truth.at("frames").at(static_cast<std::size_t>(frames));
    FrameMeasure measure, dis_measure;
    cv::Mat luma;
    {
      const Stopwatch watch;
      const cv::Mat detail = reduced_luma((*frame)->image, 640);
      measure.sharpness = dis_measure.sharpness = laplacian_variance(detail);
      luma = reduced_luma(detail, 320);
      times.sharpness += watch.milliseconds();
    }
    const auto motion_by = [&](DenseFlow& flow, double& time) {
      const Stopwatch watch;
      const cv::Mat way = flow.add(luma);
      const double length = way.empty() ? 0.0 : mean_length(way);
      time += watch.milliseconds();
      return length;
    };
    measure.motion = motion_by(farneback, times.farneback);
    dis_measure.motion = motion_by(dis, times.dis);
    with_farneback.push_back(measure);
    with_dis.push_back(dis_measure);
    FrameReading read;
    read.index = frames;
    read.time = (*frame)->time;
    read.measure = measure;
    read.focus = focus.add(read.time, measure.sharpness, measure.motion * (*source)->info().fps / luma.cols);
    {
      const Stopwatch watch;
      read.camera = motion.add(luma, read.time);
      times.motion += watch.milliseconds();
    }
    const Stopwatch watch;
    const double yaw = pass == "turn" ? now.at("subject_yaw_deg").get<double>() / degrees : 0.0;
    reading = coverage.add(read, luma, has_turntable ? std::optional(yaw) : std::nullopt);
    times.coverage += watch.milliseconds();

    read.brightness = cv::mean(luma)[0] / 255.0;
    read.motion = measure.motion * (*source)->info().fps / luma.cols;
    guidance.update(observer.add(read, reading, coverage.map()));
    for (std::size_t c = 0; c < condition_count; ++c) raised[c] += guidance.conditions()[c] ? 1 : 0;

    const Eigen::Vector3d centre = true_centre(now.at("cam_from_world"));
    const double direction = std::atan2(centre.x(), centre.z()) - yaw;
    if (frames == 0) start_height = centre.y();
    if (frames > 0) azimuth += std::remainder(direction - last, 2 * M_PI);
    last = direction;
    const double error = std::abs(reading.place.azimuth - azimuth) * degrees;
    worst = std::max(worst, error);
    if (reading.is_closed && at_closure < 0.0) {
      at_closure = reading.place.known ? error : degrees * std::abs(std::abs(azimuth) - 2 * M_PI);
    }
    if (!reading.place.known) ++unknown;
    truly_sharp.push_back(!now.at("blurred").get<bool>() && !now.at("defocused").get<bool>());
    const std::string segment = now.at("segment");
    // By where the camera really stands: between the rings, or up and down from the head's ring.
    const double head =
        0.5 * (now.at("joints").at("Head").at(1).get<double>() + now.at("joints").at("HeadEnd").at(1).get<double>());
    const double elevation = std::atan2(centre.y() - head, centre.head<3>().cross(Eigen::Vector3d::UnitY()).norm());
    if (frames == 0) start_elevation = elevation;
    constexpr double border = 17.0 / degrees;
    const Band truly = pass != "head" ? (centre.y() > start_height - 0.4 ? Band::body_upper : Band::body_lower)
                       : elevation - start_elevation > border  ? Band::crown
                       : elevation - start_elevation < -border ? Band::chin
                                                               : Band::head_ring;
    if (truly == reading.band) ++right_band;
    ++frames;
    if (std::getenv("GYRE_BENCH_FRAMES") != nullptr) {
      std::fprintf(stderr, "%d %s azimuth %.1f error %.1f height %.2f elevation %.1f subject %.2f sharp %.2f/%d %s%s\n",
                   frames - 1, segment.c_str(), azimuth * degrees, (reading.place.azimuth - azimuth) * degrees,
                   reading.place.height, reading.place.elevation * degrees, read.camera.subject_motion,
                   read.focus.sharpness, static_cast<int>(truly_sharp.back()), reading.is_closed ? "closed " : "",
                   reading.place.known ? "" : "lost");
    }
  }

  int falsely_covered = 0;
  for (const Band band : all_bands) {
    for (int s = 0; s < CoverageMap::sectors; ++s) {
      const CoverageCell& cell = coverage.map().cell(band, s);
      if (cell.is_covered() && !truly_sharp[static_cast<std::size_t>(cell.best_frame)]) ++falsely_covered;
    }
  }
  const SelectionOptions options = SelectionOptions::for_pass(pass);
  const Result<Selection> one = select_keyframes(with_farneback, options);
  const Result<Selection> other = select_keyframes(with_dis, options);
  if (!one || !other) return tl::unexpected((one ? other : one).error());
  std::vector<int> both;
  std::set_intersection(one->keyframes.begin(), one->keyframes.end(), other->keyframes.begin(), other->keyframes.end(),
                        std::back_inserter(both));

  const std::string name = folder.filename().string() + (has_turntable ? "-with-turntable" : "");
  line(name, "reduction_and_sharpness", times.sharpness / frames, "ms per frame");
  line(name, "flow_farneback", times.farneback / frames, "ms per frame");
  line(name, "flow_dis", times.dis / frames, "ms per frame");
  line(name, "tracks_and_motion", times.motion / frames, "ms per frame");
  line(name, "coverage", times.coverage / frames, "ms per frame");
  const double rest = times.sharpness + times.motion + times.coverage;
  line(name, "all_with_farneback", (rest + times.farneback) / frames, "ms per frame");
  line(name, "all_with_dis", (rest + times.dis) / frames, "ms per frame");
  line(name, "keyframes_equal_with_dis", static_cast<double>(both.size()) / static_cast<double>(one->keyframes.size()),
       "share of keyframes");
  // None of these happens in the captures.
  for (const Condition condition :
       {Condition::no_subject, Condition::too_dark, Condition::too_bright, Condition::subject_moved,
        Condition::too_close, Condition::too_far, Condition::direction_reversed}) {
    const double share = static_cast<double>(raised[static_cast<std::size_t>(condition)]) / frames;
    line(name, ("false_alarm_" + std::string(name_of(condition))).c_str(), share, "share of frames");
  }
  if (unknown < frames) line(name, "azimuth_error_worst", worst, "degrees");
  line(name, "azimuth_error_at_closure", at_closure, "degrees");
  line(name, "frames_without_place", unknown, "frames");
  if (pass != "turn") line(name, "band_right", static_cast<double>(right_band) / frames, "share of frames");
  line(name, "cells_covered_without_sharp_frame", falsely_covered, "cells");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const char* environment = std::getenv("GYRE_DATA");
  if (argc < 2 && environment == nullptr) {
    std::fputs("usage: device_bench DATA (or set GYRE_DATA to the folder of captures)\n", stderr);
    return 2;
  }
  cv::setNumThreads(1);
  const fs::path data = fs::path(argc > 1 ? argv[1] : environment) / "synthetic-a";
  struct Case {
    const char* folder;
    const char* pass;
    bool has_turntable = false;
  };
  for (const Case& one :
       {Case{"orbit-body", "body"}, {"orbit-head", "head"}, {"turn", "turn"}, {"turn", "turn", true}}) {
    if (const Result<void> done = run(data / one.folder, one.pass, one.has_turntable); !done) {
      std::fprintf(stderr, "device_bench: %s\n", done.error().message().c_str());
      return done.error().exit_code();
    }
  }
  return 0;
}
