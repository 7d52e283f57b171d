// SPDX-License-Identifier: Apache-2.0
#include "common/selection/selection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace gyre {

namespace {

std::string two_decimals(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

// Movement from the first frame up to each frame.
std::vector<double> accumulate_motion(std::span<const double> smoothed) {
  std::vector<double> travelled(smoothed.size());
  std::partial_sum(smoothed.begin(), smoothed.end(), travelled.begin());
  return travelled;
}

// f~ by frame: the smoothing runs over the movements between frames, of which there is one less than frames.
std::vector<double> smoothed_motion(std::span<const FrameMeasure> frames, double sigma) {
  std::vector<double> motion;
  motion.reserve(frames.size());
  for (const FrameMeasure& frame : frames.subspan(1)) motion.push_back(frame.motion);
  std::vector<double> smoothed = smooth(motion, sigma);
  smoothed.insert(smoothed.begin(), 0.0);
  return smoothed;
}

Result<void> check_count(std::size_t frames) {
  if (frames >= least_frames) return {};
  return fail("too few frames", std::to_string(frames),
              "a pass needs " + std::to_string(least_frames) + " or more; record for longer");
}

std::string range_text(const std::vector<int>& frames) {
  return std::to_string(frames.front()) + " to " + std::to_string(frames.back());
}

void explain(Selection& selection, const Walk& walked, const std::vector<double>& travelled) {
  const std::size_t frames = travelled.size();
  selection.decisions.resize(frames);
  std::size_t last = 0;  // the last keyframe at or before the frame
  for (std::size_t i = 0; i < frames; ++i) {
    while (last + 1 < walked.keyframes.size() && walked.keyframes[last + 1] <= static_cast<int>(i)) ++last;
    const double moved = travelled[i] - travelled[static_cast<std::size_t>(walked.keyframes[last])];
    selection.decisions[i].reason = "The camera had moved " + two_decimals(std::abs(moved) / selection.threshold) +
                                    " T from keyframe " + std::to_string(walked.keyframes[last]) + ".";
  }
  for (std::size_t k = 0; k < walked.keyframes.size(); ++k) {
    const std::vector<int>& around = walked.neighbourhoods[k];
    for (const int i : around) {
      selection.decisions[static_cast<std::size_t>(i)].reason =
          "Less sharp than keyframe " + std::to_string(walked.keyframes[k]) + " of the same neighbourhood.";
    }
  }
  for (std::size_t k = 0; k < walked.keyframes.size(); ++k) {
    const std::vector<int>& around = walked.neighbourhoods[k];
    FrameDecision& decision = selection.decisions[static_cast<std::size_t>(walked.keyframes[k])];
    decision.keyframe = true;
    decision.reason =
        "The movement reached " + std::to_string(k) + " T at frame " + std::to_string(walked.crossings[k]) + "; ";
    decision.reason += around.size() > 1
                           ? "sharpest of the " + std::to_string(around.size()) + " frames " + range_text(around) + "."
                           : "no other frame is near enough to it and to the keyframes beside it.";
  }
}

}  // namespace

SelectionOptions SelectionOptions::for_pass(std::string_view pass) {
  SelectionOptions options;
  if (pass == "head") options.keyframes = 50;
  if (pass == "turn") options.keyframes = 120;
  return options;
}

Result<void> SelectionOptions::check() const {
  if (keyframes < least_frames) {
    return wrong_use("too few keyframes asked for", std::to_string(keyframes),
                     "ask for " + std::to_string(least_frames) + " or more");
  }
  if (neighbourhood < 0) return wrong_use("the neighbourhood must not be negative", std::to_string(neighbourhood));
  if (!(sigma > 0.0)) return wrong_use("the smoothing must be positive", std::to_string(sigma));
  if (!(largest_gap >= 1.0)) return wrong_use("the largest gap must be 1 T or more", std::to_string(largest_gap));
  return {};
}

std::vector<double> smooth(std::span<const double> values, double sigma) {
  const int radius = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> kernel;
  for (int d = -radius; d <= radius; ++d) kernel.push_back(std::exp(-0.5 * d * d / (sigma * sigma)));

  const int count = static_cast<int>(values.size());
  std::vector<double> out(values.size());
  for (int i = 0; i < count; ++i) {
    double sum = 0.0;
    double weight = 0.0;
    for (int j = std::max(0, i - radius); j <= std::min(count - 1, i + radius); ++j) {
      const int offset = j - i + radius;
      const double w = kernel[static_cast<std::size_t>(offset)];
      sum += w * values[static_cast<std::size_t>(j)];
      weight += w;
    }
    out[static_cast<std::size_t>(i)] = sum / weight;
  }
  return out;
}

Walk walk(std::span<const double> travelled, std::span<const FrameMeasure> frames, double threshold, int first,
          int limit, const SelectionOptions& options) {
  const int count = static_cast<int>(travelled.size());
  const auto at = [&](int i) { return travelled[static_cast<std::size_t>(i)]; };
  const double tolerance = 1e-9 * travelled.back();
  const double reach = options.largest_gap * threshold + tolerance;

  // A frame that crosses several multiples of T at once stands for all of them.
  Walk out;
  for (int i = 0; i < limit; ++i) {
    const double target = (first + i) * threshold - tolerance;
    const int from = out.crossings.empty() ? 0 : out.crossings.back();
    const auto it = std::lower_bound(travelled.begin() + from, travelled.end(), target);
    if (it == travelled.end()) break;
    const int crossing = static_cast<int>(it - travelled.begin());
    if (out.crossings.empty() || crossing > from) out.crossings.push_back(crossing);
  }

  int before = -1;                                    // the keyframe before
  double before_travelled = (first - 1) * threshold;  // where it lies, or would lie
  if (first > 0 && !out.crossings.empty()) {
    const auto it = std::lower_bound(travelled.begin(), travelled.end(), before_travelled - tolerance);
    before = std::min(static_cast<int>(it - travelled.begin()), out.crossings.front() - 1);
  }
  for (std::size_t k = 0; k < out.crossings.size(); ++k) {
    const int crossing = out.crossings[k];
    const bool is_last = k + 1 == out.crossings.size();
    const int end = is_last ? count : out.crossings[k + 1];
    const double next_crossing = is_last ? at(crossing) + threshold : at(end);
    const int lowest = std::max(before + 1, crossing - options.neighbourhood);
    const int highest = std::min(end - 1, crossing + options.neighbourhood);

    std::vector<int> around;
    int last_within_reach = lowest;
    for (int j = lowest; j < end; ++j) {
      if (at(j) - before_travelled > reach) break;
      last_within_reach = j;
      if (j <= highest && next_crossing - at(j) <= reach) around.push_back(j);
    }
    if (around.empty()) around.push_back(last_within_reach);
    before = *std::max_element(around.begin(), around.end(), [&](int a, int b) {
      const double sharpness_a = frames[static_cast<std::size_t>(a)].sharpness;
      const double sharpness_b = frames[static_cast<std::size_t>(b)].sharpness;
      if (sharpness_a != sharpness_b) return sharpness_a < sharpness_b;
      return std::abs(a - crossing) > std::abs(b - crossing);
    });
    before_travelled = at(before);
    out.keyframes.push_back(before);
    out.neighbourhoods.push_back(std::move(around));
  }
  return out;
}

int attainable_keyframes(const SelectionOptions& options, int frames) {
  constexpr int frames_per_keyframe = 3;
  return std::min(options.keyframes, frames / frames_per_keyframe);
}

Result<Selection> select_keyframes(std::span<const FrameMeasure> frames, const SelectionOptions& options) {
  if (const Result<void> valid = options.check(); !valid) return tl::unexpected(valid.error());
  const int count = static_cast<int>(frames.size());
  if (const Result<void> enough = check_count(frames.size()); !enough) return tl::unexpected(enough.error());
  Selection selection;
  selection.smoothed = smoothed_motion(frames, options.sigma);
  const std::vector<double> travelled = accumulate_motion(selection.smoothed);
  if (!(travelled.back() >= options.least_motion * (count - 1))) {
    return fail("the camera did not move",
                "mean motion " + two_decimals(travelled.back() / (count - 1)) + " pixels a frame",
                "walk around the subject while recording");
  }
  const int keyframes = attainable_keyframes(options, count);
  selection.threshold = travelled.back() / keyframes;

  Walk walked = walk(travelled, frames, selection.threshold, 0, keyframes, options);
  for (std::size_t k = 1; k < walked.keyframes.size(); ++k) {
    const double gap = travelled[static_cast<std::size_t>(walked.keyframes[k])] -
                       travelled[static_cast<std::size_t>(walked.keyframes[k - 1])];
    selection.widest_gap = std::max(selection.widest_gap, gap / selection.threshold);
  }
  explain(selection, walked, travelled);
  selection.keyframes = std::move(walked.keyframes);
  selection.neighbourhoods = std::move(walked.neighbourhoods);
  return selection;
}

Result<Selection> keep_all(std::span<const FrameMeasure> frames) {
  if (const Result<void> enough = check_count(frames.size()); !enough) return tl::unexpected(enough.error());
  Selection selection;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    selection.smoothed.push_back(frames[i].motion);
    selection.keyframes.push_back(static_cast<int>(i));
    selection.neighbourhoods.push_back({static_cast<int>(i)});
  }
  selection.decisions.assign(frames.size(), {true, "Every photograph of a small folder is kept."});
  return selection;
}

}  // namespace gyre
