// SPDX-License-Identifier: Apache-2.0
// Measures the `cameras` stage of a bundle against true cameras, one JSON line per figure, and against COLMAP on the
// same pictures where it is installed.
//
//   cameras_bench BUNDLE TRUTH_DIR [--colmap-all] [--colmap-pairs]   TRUTH_DIR: see camera_scores.h
//
// --colmap-all has COLMAP match every two pictures as it does by default, --colmap-pairs the pairs Gyre chooses.
#include "common/log/log.h"
#include "offload/cameras/cameras_stage.h"
#include "offload/cameras/features.h"
#include "offload/cameras/pairs.h"
#include "tests/bench/camera_scores.h"
#include "tests/bench/colmap_baseline.h"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <set>

namespace {

using gyre::bench::print_figure;

int fail_with(const std::string& text) {
  std::fprintf(stderr, "cameras_bench: %s\n", text.c_str());
  return 1;
}

// The pairs the stage matches, by keyframe name.
gyre::Result<std::vector<std::pair<std::string, std::string>>> chosen_pairs(const gyre::Bundle& bundle, bool ordered) {
  const auto ids = gyre::list_frames(bundle);
  if (!ids) return tl::unexpected<gyre::Error>(ids.error());
  std::vector<gyre::Features> features;
  std::vector<std::string> passes;
  gyre::CaptureOrder order;
  order.ordered = ordered;
  for (const gyre::FrameId& id : *ids) {
    const auto picture = gyre::read_upright(bundle.frame(id.pass, id.index));
    if (!picture) return tl::unexpected<gyre::Error>(picture.error());
    features.push_back(gyre::detect_features(*picture, {}));
    if (passes.empty() || passes.back() != id.pass) passes.push_back(id.pass);
    order.pass_of.push_back(static_cast<int>(passes.size()) - 1);
  }
  const gyre::PairOptions options;
  std::vector<std::pair<std::string, std::string>> pairs;
  const auto name = [&](int i) { return gyre::frame_name((*ids)[i].pass, (*ids)[i].index); };
  for (const auto& [a, b] : gyre::choose_pairs(order, gyre::similarity_votes(features, options, 0), options))
    pairs.emplace_back(name(a), name(b));
  return pairs;
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("cameras_bench", "warn");
  if (argc < 3) return fail_with("usage: cameras_bench BUNDLE TRUTH_DIR [--colmap-all] [--colmap-pairs]");
  const gyre::Bundle bundle(argv[1]);
  const std::set<std::string> wanted(argv + 3, argv + argc);
  const auto truth = gyre::bench::read_true_cameras(argv[2], bundle);
  if (!truth) return fail_with(truth.error().message());
  const auto scan = gyre::read_scan(bundle);
  if (!scan) return fail_with(scan.error().message());
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("gyre-cameras-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(out);
  const gyre::Stage stage = gyre::cameras_stage();
  const gyre::StageContext context{.bundle = bundle, .out = out, .options = stage.options};
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t cpu_begin = std::clock();
  const auto result = stage.run(context);
  if (!result) return fail_with(result.error().message());
  const std::string name = bundle.root().filename().string();
  const double cpu = static_cast<double>(std::clock() - cpu_begin) / CLOCKS_PER_SEC;
  print_figure("cameras", name, "wall", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
               "s");
  print_figure("cameras", name, "cpu", cpu, "s");
  const auto model = gyre::read_colmap_model(out);
  if (!model) return fail_with(model.error().message());
  const auto scores = gyre::bench::score_cameras(*model, *truth);
  if (!scores) return fail_with(scores.error().message());
  print_figure("cameras", name, "registered", (*result)["registered"].get<double>() / (*result)["total"].get<double>(),
               "share");
  gyre::bench::print_scores(name, *scores);
  print_figure("cameras", name, "scale_error", 100 * std::abs(scores->scale - 1), "percent");

  for (const std::string mode : {"--colmap-pairs", "--colmap-all"}) {
    if (!wanted.contains(mode)) continue;
    if (!gyre::bench::colmap_is_installed()) {
      std::fprintf(stderr, "cameras_bench: COLMAP is not installed, nothing to compare with\n");
      break;
    }
    std::vector<std::pair<std::string, std::string>> pairs;
    if (mode == "--colmap-pairs") {
      const bool ordered =
          std::any_of(scan->passes.begin(), scan->passes.end(), [](const auto& p) { return p.fps > 0; });
      auto chosen = chosen_pairs(bundle, ordered);
      if (!chosen) return fail_with(chosen.error().message());
      pairs = std::move(*chosen);
    }
    const auto colmap = gyre::bench::run_colmap(bundle.frames(), pairs, out / "colmap");
    if (!colmap) return fail_with(colmap.error().message());
    const std::string their_name = name + "/colmap" + (pairs.empty() ? "" : "-with-our-pairs");
    const auto their_scores = gyre::bench::score_cameras(colmap->model, *truth);
    if (!their_scores) return fail_with(their_scores.error().message());
    gyre::bench::print_scores(their_name, *their_scores);
    print_figure("cameras", their_name, "extraction_cpu", colmap->extraction, "s");
    print_figure("cameras", their_name, "matching_cpu", colmap->matching, "s");
    print_figure("cameras", their_name, "mapping_cpu", colmap->mapping, "s");
    print_figure("cameras", their_name, "cpu_ratio", cpu / colmap->cpu(), "ours/theirs");
  }
  std::filesystem::remove_all(out);
  return 0;
}
