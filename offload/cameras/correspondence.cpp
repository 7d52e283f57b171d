// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/correspondence.h"

#include "common/parallel/parallel.h"
#include "offload/cameras/matching.h"

namespace gyre {

namespace {

constexpr std::size_t pairs_between_reports = 32;

}  // namespace

std::vector<ViewPair> find_correspondences(std::span<const Features> features, const CaptureOrder& order,
                                           const StaticBackground& background, const CorrespondenceOptions& options,
                                           const Progress& progress) {
  progress(0.0, "choosing pairs of pictures");
  const Eigen::MatrixXi votes = similarity_votes(features, options.pairs, options.threads);
  const auto pairs = choose_pairs(order, votes, options.pairs);

  std::vector<ViewPair> verified(pairs.size());
  for (std::size_t begin = 0; begin < pairs.size(); begin += pairs_between_reports) {
    progress(0.05 + 0.95 * static_cast<double>(begin) / static_cast<double>(pairs.size()), "matching pictures");
    parallel_for(std::min(pairs_between_reports, pairs.size() - begin), options.threads, [&](std::size_t i) {
      const auto [a, b] = pairs[begin + i];
      const auto ia = static_cast<std::size_t>(a), ib = static_cast<std::size_t>(b);
      const Features &fa = features[ia], &fb = features[ib];
      auto matches = match_features(fa, fb, options.matching);
      if (order.pass_of[ia] == order.pass_of[ib] && background.motion[ia] == Motion::turn)
        drop_still_matches(matches, fa, fb, background.shift[ib] - background.shift[ia], options.stillness);
      verified[begin + i] = {a, b, verify_matches(fa.keypoints, fb.keypoints, matches, options.verification)};
    });
  }
  std::erase_if(verified, [](const ViewPair& pair) { return pair.matches.empty(); });
  return verified;
}

}  // namespace gyre
