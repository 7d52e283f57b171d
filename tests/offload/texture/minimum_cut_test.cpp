// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/minimum_cut.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <limits>
#include <random>

namespace gyre {
namespace {

struct Penalty {
  int zero = 0, one = 0;
  float value = 0;
};

// Of the labelling whose bit n is x_n.
double energy(unsigned labelling, const std::vector<float>& costs, const std::vector<Penalty>& penalties) {
  const auto x = [&](int n) { return (labelling >> static_cast<unsigned>(n)) & 1U; };
  double sum = 0;
  for (std::size_t n = 0; n < costs.size(); ++n) sum += x(static_cast<int>(n)) * double{costs[n]};
  for (const Penalty& p : penalties) sum += (1 - x(p.zero)) * x(p.one) * double{p.value};
  return sum;
}

TEST(MinimumCut, FindsTheCheapestOfAllLabellings) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> cost(-1, 1), penalty(0, 0.8F);
  std::uniform_int_distribution<int> node(0, 9);
  for (int round = 0; round < 50; ++round) {
    std::vector<float> costs(10);
    std::generate(costs.begin(), costs.end(), [&] { return cost(random); });
    std::vector<Penalty> penalties;
    for (int e = 0; e < 20; ++e) {
      const Penalty p{node(random), node(random), penalty(random)};
      if (p.zero != p.one) penalties.push_back(p);
    }
    MinimumCut cut(costs.size());
    for (std::size_t n = 0; n < costs.size(); ++n) cut.add_cost(static_cast<int>(n), costs[n]);
    for (const Penalty& p : penalties) cut.add_penalty(p.zero, p.one, p.value);
    const std::vector<std::uint8_t> x = cut.solve();
    unsigned found = 0;
    for (std::size_t n = 0; n < x.size(); ++n) found |= unsigned{x[n]} << n;
    double best = std::numeric_limits<double>::infinity();
    for (unsigned labelling = 0; labelling < (1U << 10U); ++labelling)
      best = std::min(best, energy(labelling, costs, penalties));
    EXPECT_NEAR(energy(found, costs, penalties), best, 1e-5) << round;
  }
}

TEST(MinimumCut, DecidesEachNodeAloneWithoutPenalties) {
  MinimumCut cut(3);
  cut.add_cost(0, -0.5F);
  cut.add_cost(1, 0.5F);
  cut.add_penalty(0, 2, -1);
  EXPECT_EQ(cut.solve(), (std::vector<std::uint8_t>{1, 0, 0}));
}

}  // namespace
}  // namespace gyre
