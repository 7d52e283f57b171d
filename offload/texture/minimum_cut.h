// SPDX-License-Identifier: Apache-2.0
// The cheapest yes-or-no choice for many things at once, where some pay for differing from others.
#pragma once

#include <cstdint>
#include <vector>

namespace gyre {

// Minimises sum_n cost_n x_n + sum_(n, m) penalty_nm (1 - x_n) x_m over x in {0, 1}, exactly, by one minimum cut
// (Kolmogorov and Zabih, PAMI 2004) with the maximum flow of Boykov and Kolmogorov (PAMI 2004) as OpenCV has it.
class MinimumCut {
 public:
  // Nodes 0 to nodes - 1; costs are 0 at first.
  explicit MinimumCut(std::size_t nodes) : cost_(nodes, 0.0F) {}

  // For x_node = 1; may be negative. Adds up.
  void add_cost(int node, float cost) { cost_[static_cast<std::size_t>(node)] += cost; }
  // For x_zero = 0 with x_one = 1; at least 0, what is below counts as 0. Adds up.
  void add_penalty(int zero, int one, float penalty);

  // x of every node. Where both are as cheap, 0.
  std::vector<std::uint8_t> solve() const;

 private:
  struct Penalty {
    int zero = 0, one = 0;
    float value = 0;
  };
  std::vector<float> cost_;
  std::vector<Penalty> penalties_;
};

}  // namespace gyre
