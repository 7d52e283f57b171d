// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/matching.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

std::vector<Descriptor> random_descriptors(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Descriptor> descriptors(count);
  for (Descriptor& d : descriptors) {
    std::array<float, 128> sift{};
    // Few large entries, so that some descriptors are near each other and some ratios fail.
    for (float& value : sift) value = random() % 8 == 0 ? static_cast<float>(random() % 256) : 1.0F;
    d = root_sift(sift.data());
  }
  return descriptors;
}

std::vector<Descriptor> disturbed(std::vector<Descriptor> descriptors, int amount, unsigned seed) {
  std::mt19937 random(seed);
  for (Descriptor& d : descriptors)
    for (std::int16_t& value : d)
      value = static_cast<std::int16_t>(std::max(0, value + static_cast<int>(random() % (2 * amount + 1)) - amount));
  return descriptors;
}

// The definition, without blocks: mutual nearest neighbours by dot product with the ratio test both ways.
std::vector<Match> by_definition(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b,
                                 const MatchOptions& options) {
  const auto dot = [](const Descriptor& x, const Descriptor& y) {
    return std::inner_product(x.begin(), x.end(), y.begin(), 0);
  };
  const auto nearest = [&](const Descriptor& of, const std::vector<Descriptor>& among) {
    std::vector<std::pair<int, int>> sorted;
    for (std::size_t i = 0; i < among.size(); ++i) sorted.emplace_back(-dot(of, among[i]), static_cast<int>(i));
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  };
  const auto distinct = [&](const std::vector<std::pair<int, int>>& sorted) {
    const auto distance2 = [](int minus_dot) { return std::max(0.0, 2.0 + 2.0 * minus_dot / (512.0 * 512.0)); };
    const double best = distance2(sorted[0].first);
    return best <= options.max_distance * options.max_distance &&
           best < options.max_ratio * options.max_ratio * distance2(sorted[1].first);
  };
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto in_b = nearest(a[i], b);
    const auto in_a = nearest(b[static_cast<std::size_t>(in_b[0].second)], a);
    if (in_a[0].second == static_cast<int>(i) && distinct(in_b) && distinct(in_a))
      matches.push_back({static_cast<int>(i), in_b[0].second});
  }
  return matches;
}

TEST(Matching, equals_the_definition_for_sizes_around_the_blocks) {
  for (const std::size_t count : {2U, 5U, 255U, 261U, 530U}) {
    const auto a = random_descriptors(count, 1);
    auto b = disturbed(a, 12, 2);
    const auto more = random_descriptors(count / 2 + 1, 3);
    b.insert(b.begin(), more.begin(), more.end());
    EXPECT_EQ(match_descriptors(a, b), by_definition(a, b, {})) << count;
    EXPECT_EQ(match_descriptors(b, a), by_definition(b, a, {})) << count;
  }
}

TEST(Matching, finds_the_permutation_of_disturbed_descriptors) {
  const auto a = random_descriptors(300, 4);
  std::vector<Descriptor> b(a.rbegin(), a.rend());
  const auto matches = match_descriptors(a, disturbed(b, 4, 5));
  ASSERT_EQ(matches.size(), a.size());
  for (const Match& m : matches) EXPECT_EQ(m.b, 299 - m.a);
}

TEST(Matching, a_repeated_pattern_matches_nothing) {
  const auto one = random_descriptors(1, 6);
  const std::vector<Descriptor> repeated(20, one[0]);
  EXPECT_TRUE(match_descriptors(repeated, repeated).empty());
}

TEST(Matching, nothing_matches_nothing) {
  EXPECT_TRUE(match_descriptors({}, random_descriptors(3, 1)).empty());
  EXPECT_TRUE(match_descriptors(random_descriptors(3, 1), {}).empty());
}

TEST(Matching, a_keypoint_with_two_orientations_is_matched_once) {
  Features a;
  a.descriptors = random_descriptors(20, 8);
  a.keypoints.resize(10);
  for (int i = 0; i < 20; ++i) a.keypoint_of.push_back(i / 2);
  const auto matches = match_features(a, a);
  ASSERT_EQ(matches.size(), 10U);
  for (const Match& m : matches) EXPECT_EQ(m.a, m.b);
}

}  // namespace
}  // namespace gyre
