// SPDX-License-Identifier: Apache-2.0
// Keyframe selection on the synthetic captures with known truth, as JSON lines: select_bench DATA
#include "common/selection/ingest.h"
#include "common/selection/streaming.h"
#include "common/video/frame_source.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace {

using namespace gyre;
namespace fs = std::filesystem;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

struct Case {
  const char* folder;
  const char* pass;
};

class Report {
 public:
  explicit Report(std::string name) : name_(std::move(name)) {}

  void line(const char* metric, double value, const char* unit) const {
    const nlohmann::ordered_json line = {
        {"bench", "select"}, {"case", name_}, {"metric", metric}, {"value", value}, {"unit", unit}};
    std::puts(line.dump().c_str());
  }

 private:
  std::string name_;
};

// Frames the truth calls blurred or defocused.
std::vector<bool> unsharp_frames(const fs::path& truth) {
  std::ifstream file(truth);
  const nlohmann::json json = nlohmann::json::parse(file);
  std::vector<bool> unsharp;
  for (const nlohmann::json& frame : json.at("frames")) {
    unsharp.push_back(frame.at("blurred").get<bool>() || frame.at("defocused").get<bool>());
  }
  return unsharp;
}

// Keyframes without sharpness although the frames they were chosen from hold a sharp one.
int avoidable(const Selection& selection, const std::vector<bool>& unsharp) {
  int count = 0;
  for (std::size_t k = 0; k < selection.keyframes.size(); ++k) {
    const std::vector<int>& around = selection.neighbourhoods[k];
    const bool has_sharp =
        std::any_of(around.begin(), around.end(), [&](int i) { return !unsharp[static_cast<std::size_t>(i)]; });
    if (unsharp[static_cast<std::size_t>(selection.keyframes[k])] && has_sharp) ++count;
  }
  return count;
}

Result<void> run(const fs::path& folder, const Case& which) {
  const Report report(which.folder);
  Result<std::unique_ptr<FrameSource>> source = open_capture(folder / "video.mp4");
  if (!source) return tl::unexpected(source.error());
  const std::vector<bool> unsharp = unsharp_frames(folder / "truth.json");

  StreamingOptions options;
  options.selection = SelectionOptions::for_pass(which.pass);
  options.expected_frames = (*source)->info().expected_frames;
  StreamingSelector selector(options);
  std::set<int> proposed;
  std::vector<FrameMeasure> measures;
  double flow_ms = 0.0;
  double sharpness_ms = 0.0;
  double streaming_ms = 0.0;
  const MeasureOptions sizes;
  DenseFlow dense_flow;
  for (;;) {
    const Result<std::optional<Frame>> frame = (*source)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) break;
    FrameMeasure measure;
    auto start = std::chrono::steady_clock::now();
    const cv::Mat detail = reduced_luma((*frame)->image, sizes.sharpness_size);
    measure.sharpness = laplacian_variance(detail);
    sharpness_ms += milliseconds_since(start);
    start = std::chrono::steady_clock::now();
    const cv::Mat flow = dense_flow.add(reduced_luma(detail, sizes.flow_size));
    if (!flow.empty()) measure.motion = mean_length(flow);
    flow_ms += milliseconds_since(start);
    start = std::chrono::steady_clock::now();
    if (const std::optional<int> candidate = selector.push(measure)) proposed.insert(*candidate);
    streaming_ms += milliseconds_since(start);
    measures.push_back(measure);
  }

  const Result<Selection> reference = select_keyframes(measures, options.selection);
  if (!reference) return tl::unexpected(reference.error());
  const Result<Selection> sent = selector.finish();
  if (!sent) return tl::unexpected(sent.error());
  const auto frames = static_cast<double>(measures.size());
  const auto keyframes = static_cast<double>(sent->keyframes.size());
  const auto early = static_cast<double>(
      std::count_if(sent->keyframes.begin(), sent->keyframes.end(), [&](int i) { return proposed.contains(i); }));
  const auto unsharp_keyframes = static_cast<double>(std::count_if(
      sent->keyframes.begin(), sent->keyframes.end(), [&](int i) { return unsharp[static_cast<std::size_t>(i)]; }));
  report.line("frames", frames, "frames");
  report.line("keyframes", keyframes, "frames");
  report.line("equals_two_pass", sent->keyframes == reference->keyframes ? 1 : 0, "bool");
  report.line("largest_gap", sent->widest_gap, "T");
  report.line("unsharp_keyframes_avoidable", avoidable(*sent, unsharp), "frames");
  report.line("unsharp_keyframes", unsharp_keyframes, "frames");
  report.line("unsharp_frames", static_cast<double>(std::count(unsharp.begin(), unsharp.end(), true)), "frames");
  report.line("sent_before_stop", early / keyframes, "share of keyframes");
  report.line("candidates", static_cast<double>(proposed.size()), "frames");
  report.line("discarded", (static_cast<double>(proposed.size()) - early) / keyframes, "share of keyframes");
  report.line("flow", flow_ms / frames, "ms per frame");
  report.line("sharpness", sharpness_ms / frames, "ms per frame");
  report.line("streaming", streaming_ms / frames, "ms per frame");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const char* environment = std::getenv("GYRE_DATA");
  if (argc < 2 && environment == nullptr) {
    std::fputs("usage: select_bench DATA (or set GYRE_DATA to the folder of captures)\n", stderr);
    return 2;
  }
  const fs::path data = argc > 1 ? argv[1] : environment;
  for (const Case& which : {Case{"orbit-body", "body"}, Case{"orbit-head", "head"}, Case{"turn", "turn"}}) {
    if (const Result<void> done = run(data / "synthetic-a" / which.folder, which); !done) {
      std::fprintf(stderr, "select_bench: %s\n", done.error().message().c_str());
      return done.error().exit_code();
    }
  }
  return 0;
}
