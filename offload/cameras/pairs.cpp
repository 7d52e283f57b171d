// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/pairs.h"

#include "common/parallel/parallel.h"
#include "offload/cameras/matching.h"

#include <cmath>
#include <set>

namespace gyre {

Eigen::MatrixXi similarity_votes(std::span<const Features> features, const PairOptions& options, int threads) {
  const auto count = static_cast<Eigen::Index>(features.size());
  Eigen::MatrixXi votes = Eigen::MatrixXi::Zero(count, count);
  const auto largest = [&](std::size_t i) {
    const std::span<const Descriptor> all(features[i].descriptors);
    return all.first(std::min(all.size(), static_cast<std::size_t>(options.voting_features)));
  };
  parallel_for(features.size(), threads, [&](std::size_t a) {
    for (std::size_t b = a + 1; b < features.size(); ++b)
      votes(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
          static_cast<int>(match_descriptors(largest(a), largest(b)).size());
  });
  votes += votes.transpose().eval();
  return votes;
}

namespace {

// The sharpest pictures of a picture's pass that were taken from nearly its side, but not just before or after it.
std::vector<int> from_the_same_side(const CaptureOrder& order, int a, const PairOptions& options) {
  const auto sharpness = [&](int i) {
    return order.sharpness.empty() ? 0.0 : order.sharpness[static_cast<std::size_t>(i)];
  };
  std::vector<int> found;
  const auto& from = order.azimuth[static_cast<std::size_t>(a)];
  for (int b = 0; from && b < static_cast<int>(order.azimuth.size()); ++b) {
    const auto& to = order.azimuth[static_cast<std::size_t>(b)];
    if (!to || order.pass_of[static_cast<std::size_t>(a)] != order.pass_of[static_cast<std::size_t>(b)]) continue;
    if (std::abs(a - b) <= options.neighbours) continue;
    if (std::abs(std::remainder(*to - *from, 360.0)) <= options.azimuth_range) found.push_back(b);
  }
  std::stable_sort(found.begin(), found.end(), [&](int x, int y) { return sharpness(x) > sharpness(y); });
  found.resize(std::min(found.size(), static_cast<std::size_t>(options.same_azimuth)));
  return found;
}

}  // namespace

std::vector<std::pair<int, int>> choose_pairs(const CaptureOrder& order, const Eigen::MatrixXi& votes,
                                              const PairOptions& options) {
  const std::vector<int>& pass_of = order.pass_of;
  const int count = static_cast<int>(pass_of.size());
  std::set<std::pair<int, int>> pairs;
  const auto add = [&](int a, int b) {
    if (a != b && a >= 0 && b >= 0 && a < count && b < count) pairs.emplace(std::min(a, b), std::max(a, b));
  };
  if (!order.ordered && count <= options.exhaustive_up_to) {
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b) add(a, b);
    return {pairs.begin(), pairs.end()};
  }
  const auto add_in_pass = [&](int a, int b) {
    if (b < count && pass_of[static_cast<std::size_t>(a)] == pass_of[static_cast<std::size_t>(b)]) add(a, b);
  };
  for (int a = 0; a < count; ++a) {
    for (int step = 1; step <= options.neighbours; ++step) add_in_pass(a, a + step);
    for (int step = 8; step <= options.largest_step; step *= 2) add_in_pass(a, a + step);

    std::vector<int> by_votes;
    for (int b = 0; b < count; ++b)
      if (b != a && votes(a, b) >= options.min_votes) by_votes.push_back(b);
    std::stable_sort(by_votes.begin(), by_votes.end(), [&](int x, int y) { return votes(a, x) > votes(a, y); });
    int taken = 0, taken_other_pass = 0;
    for (const int b : by_votes) {
      const bool other = pass_of[static_cast<std::size_t>(a)] != pass_of[static_cast<std::size_t>(b)];
      if (!other && b > a - options.neighbours - 1 && b < a + options.neighbours + 1) continue;
      if (taken < options.best_votes || (other && taken_other_pass < options.best_votes_other_pass)) {
        add(a, b);
        ++taken;
        if (other) ++taken_other_pass;
      }
    }
  }
  for (int a = 0; a < count && !order.azimuth.empty(); ++a)
    for (const int b : from_the_same_side(order, a, options)) add(a, b);
  return {pairs.begin(), pairs.end()};
}

}  // namespace gyre
