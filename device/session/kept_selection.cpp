// SPDX-License-Identifier: Apache-2.0
#include "device/session/kept_selection.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

namespace {

// The kept frame nearest to `wanted` that lies after `first` and before `end`.
std::optional<int> nearest_kept(int wanted, int first, int end, const std::function<bool(int)>& is_kept) {
  for (int away = 0; wanted - away > first || wanted + away < end; ++away) {
    for (const int i : {wanted - away, wanted + away}) {
      if (i > first && i < end && is_kept(i)) return i;
    }
  }
  return std::nullopt;
}

}  // namespace

Result<Selection> select_among_kept(std::span<const FrameMeasure> frames, const std::function<bool(int)>& is_kept,
                                    const SelectionOptions& options) {
  constexpr double never = -1.0;  // less sharp than any frame
  std::vector<FrameMeasure> measures(frames.begin(), frames.end());
  const int count = static_cast<int>(measures.size());
  for (int i = 0; i < count; ++i) {
    if (!is_kept(i)) measures[static_cast<std::size_t>(i)].sharpness = never;
  }
  Result<Selection> selection = select_keyframes(measures, options);
  if (!selection) return selection;

  const std::vector<int> wanted = selection->keyframes;
  std::vector<int> keyframes;
  std::vector<std::vector<int>> neighbourhoods;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const int before = keyframes.empty() ? -1 : keyframes.back();
    const int end = k + 1 < wanted.size() ? wanted[k + 1] : count;
    const std::optional<int> found = nearest_kept(wanted[k], before, end, is_kept);
    FrameDecision& decision = selection->decisions[static_cast<std::size_t>(wanted[k])];
    if (found != wanted[k]) {
      decision = {false, "Wanted as a keyframe, but not kept while recording."};
    }
    if (!found) continue;
    if (found != wanted[k]) {
      selection->decisions[static_cast<std::size_t>(*found)] = {
          true, "Stands for frame " + std::to_string(wanted[k]) + ", which was not kept while recording."};
    }
    keyframes.push_back(*found);
    neighbourhoods.push_back(selection->neighbourhoods[k]);
  }
  if (keyframes.empty()) return fail("no frame was kept", "", "give the recording more memory");

  selection->widest_gap = 0.0;
  for (std::size_t k = 1; k < keyframes.size(); ++k) {
    const double gap = std::accumulate(selection->smoothed.begin() + keyframes[k - 1] + 1,
                                       selection->smoothed.begin() + keyframes[k] + 1, 0.0);
    selection->widest_gap = std::max(selection->widest_gap, gap / selection->threshold);
  }
  selection->keyframes = std::move(keyframes);
  selection->neighbourhoods = std::move(neighbourhoods);
  return selection;
}

}  // namespace gyre
