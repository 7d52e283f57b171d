// SPDX-License-Identifier: Apache-2.0
// The `cameras` stage on rendered orbits with exact truth: five people and rooms, each still, swaying, under drifting
// exposure and with a tenth of the arc missing; and one orbit with 50 to 300 keyframes, for how time and memory grow.
//
//   orbits_bench WORK_DIR [--growth]
#include "common/bundle/ulid.h"
#include "common/log/log.h"
#include "common/parallel/parallel.h"
#include "offload/cameras/cameras_stage.h"
#include "tests/bench/camera_scores.h"
#include "tests/synthetic/capture.h"

#include <sys/resource.h>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <opencv2/imgcodecs.hpp>

namespace {

using gyre::bench::print_figure;

struct Case {
  std::string name;
  gyre::synthetic::CaptureOptions options;
  double missing = 0.0;  // share of the frames that are left out in one piece
};

struct Orbit {
  gyre::Bundle bundle;
  gyre::bench::TrueCameras truth;
};

// Keyframes of the capture as a bundle.
gyre::Result<Orbit> write_orbit(const Case& c, int keyframes, const std::filesystem::path& folder) {
  const gyre::synthetic::Capture capture = gyre::synthetic::make_capture(c.options);
  std::filesystem::remove_all(folder);
  gyre::Scan scan;
  scan.id = gyre::new_ulid();
  scan.device = "synthetic";
  scan.height_mm = 1000 * c.options.stature;
  scan.passes.push_back({"body", c.options.fps, c.options.frames, c.options.width, c.options.height});
  const auto bundle = gyre::create_bundle(folder, scan);
  if (!bundle) return tl::unexpected<gyre::Error>(bundle.error());
  Orbit orbit{*bundle, {}};
  orbit.truth.camera = capture.camera;
  std::vector<int> chosen;
  const auto frames = static_cast<int>(capture.frames.size());
  const int kept = static_cast<int>(std::lround((1 - c.missing) * frames));
  for (int k = 0; k < keyframes; ++k) {
    int index = k * kept / keyframes;
    while (index + 1 < kept && (capture.frames[index].blurred || capture.frames[index].stopped)) ++index;
    if (chosen.empty() || index > chosen.back()) chosen.push_back(index);
  }
  gyre::parallel_for(chosen.size(), 0, [&](std::size_t i) {
    cv::imwrite(bundle->frame("body", chosen[i]).string(), gyre::synthetic::render_frame(capture, chosen[i]),
                {cv::IMWRITE_JPEG_QUALITY, 93});
  });
  for (const int index : chosen)
    orbit.truth.cam_from_world[gyre::frame_name("body", index)] = capture.frames[index].cam_from_world;
  return orbit;
}

gyre::Result<void> measure(const Case& c, int keyframes, const std::filesystem::path& work) {
  const auto orbit = write_orbit(c, keyframes, work / "orbit");
  if (!orbit) return tl::unexpected<gyre::Error>(orbit.error());
  const gyre::Stage stage = gyre::cameras_stage();
  const gyre::StageContext context{.bundle = orbit->bundle, .out = work, .options = stage.options};
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t cpu_begin = std::clock();
  const auto result = stage.run(context);
  const double cpu = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!result) return tl::unexpected<gyre::Error>(result.error());
  const auto model = gyre::read_colmap_model(work);
  if (!model) return tl::unexpected<gyre::Error>(model.error());
  const auto scores = gyre::bench::score_cameras(*model, orbit->truth);
  if (!scores) return tl::unexpected<gyre::Error>(scores.error());
  print_figure("orbits", c.name, "registered", (*result)["registered"].get<double>() / (*result)["total"].get<double>(),
               "share");
  const auto& ring = (*result)["ring"];
  print_figure("orbits", c.name, "ring_closed", ring["closed"].get<bool>() ? 1 : 0, "flag");
  print_figure("orbits", c.name, "ring_covered", ring["covered_deg"].get<double>(), "deg");
  gyre::bench::print_scores(c.name, *scores);
  print_figure("orbits", c.name, "cpu", cpu, "s");
  print_figure("orbits", c.name, "wall", wall, "s");
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  print_figure("orbits", c.name, "peak_memory_so_far", static_cast<double>(usage.ru_maxrss) / 1024, "MiB");
  return {};
}

int fail_with(const std::string& text) {
  std::fprintf(stderr, "orbits_bench: %s\n", text.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("orbits_bench", "warn");
  if (argc < 2) return fail_with("usage: orbits_bench WORK_DIR [--growth]");
  const std::filesystem::path work = argv[1];
  std::filesystem::create_directories(work);
  if (argc > 2 && std::string(argv[2]) == "--growth") {
    for (const int keyframes : {50, 100, 200, 300}) {
      Case c{std::to_string(keyframes) + " keyframes", {}};
      c.options.frames = 600;
      if (const auto done = measure(c, keyframes, work); !done) return fail_with(done.error().message());
    }
    return 0;
  }
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    gyre::synthetic::CaptureOptions still;
    still.seed = seed;
    still.exposure_drift = 0.0;
    auto swaying = still;
    // 4 mm at the height of the chest.
    swaying.sway_deg = 57.29577951308232 * 0.004 / 1.3;
    auto drifting = still;
    drifting.exposure_drift = 0.2;
    const std::string person = "seed " + std::to_string(seed);
    for (const Case& c : {Case{person + " still", still}, Case{person + " swaying", swaying},
                          Case{person + " drifting exposure", drifting}, Case{person + " a tenth missing", still, 0.1}})
      if (const auto done = measure(c, 75, work); !done) return fail_with(c.name + ": " + done.error().message());
  }
  return 0;
}
