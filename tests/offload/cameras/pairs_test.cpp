// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/pairs.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

bool has(const std::vector<std::pair<int, int>>& pairs, int a, int b) {
  return std::binary_search(pairs.begin(), pairs.end(), std::pair(a, b));
}

TEST(Pairs, unordered_photographs_are_all_matched_up_to_the_limit) {
  const std::vector<int> pass(10, 0);
  EXPECT_EQ(choose_pairs({.pass_of = pass, .ordered = false}, Eigen::MatrixXi::Zero(10, 10), {}).size(), 45U);
}

TEST(Pairs, neighbours_stay_within_their_pass) {
  std::vector<int> pass(20, 0);
  std::fill(pass.begin() + 12, pass.end(), 1);
  const auto pairs = choose_pairs({.pass_of = pass, .ordered = true}, Eigen::MatrixXi::Zero(20, 20), {});
  EXPECT_TRUE(has(pairs, 3, 4));
  EXPECT_TRUE(has(pairs, 3, 7));
  EXPECT_TRUE(has(pairs, 3, 11));
  EXPECT_FALSE(has(pairs, 3, 8));
  EXPECT_FALSE(has(pairs, 11, 12));
  EXPECT_TRUE(has(pairs, 12, 13));
}

TEST(Pairs, votes_close_the_ring_and_link_the_passes) {
  std::vector<int> pass(30, 0);
  std::fill(pass.begin() + 20, pass.end(), 1);
  Eigen::MatrixXi votes = Eigen::MatrixXi::Zero(30, 30);
  votes(0, 19) = votes(19, 0) = 40;
  votes(7, 25) = votes(25, 7) = 15;
  votes(2, 14) = votes(14, 2) = 2;  // below the limit
  const auto pairs = choose_pairs({.pass_of = pass, .ordered = true}, votes, {});
  EXPECT_TRUE(has(pairs, 0, 19));
  EXPECT_TRUE(has(pairs, 7, 25));
  EXPECT_FALSE(has(pairs, 2, 14));
}

TEST(Pairs, another_pass_gets_its_share_beside_many_similar_pictures_of_the_same) {
  std::vector<int> pass(40, 0);
  pass[39] = 1;
  Eigen::MatrixXi votes = Eigen::MatrixXi::Zero(40, 40);
  for (int b = 10; b < 39; ++b) votes(0, b) = votes(b, 0) = 100;
  votes(0, 39) = votes(39, 0) = 10;
  EXPECT_TRUE(has(choose_pairs({.pass_of = pass, .ordered = true}, votes, {}), 0, 39));
}

TEST(Pairs, azimuths_link_the_rings_of_a_pass_by_its_sharpest_pictures) {
  // Two rings of 36 pictures, 10 degrees apart.
  CaptureOrder order{.pass_of = std::vector<int>(72, 0)};
  for (int i = 0; i < 72; ++i) {
    order.azimuth.emplace_back(10.0 * (i % 36));
    order.sharpness.push_back(i == 41 ? 1.0 : 100.0);
  }
  order.azimuth[50].reset();
  PairOptions options;
  options.same_azimuth = 2;
  const auto pairs = choose_pairs(order, Eigen::MatrixXi::Zero(72, 72), options);
  EXPECT_TRUE(has(pairs, 20, 56));
  EXPECT_TRUE(has(pairs, 0, 35) || has(pairs, 0, 71));  // across 360 degrees
  EXPECT_TRUE(has(pairs, 4, 40));
  EXPECT_FALSE(has(pairs, 6, 41));  // blurred, and 42 and 43 are as near
  EXPECT_FALSE(has(pairs, 14, 50));
  EXPECT_FALSE(has(pairs, 5, 23));
}

}  // namespace
}  // namespace gyre
