// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/minimum_cut.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

namespace gyre {

namespace {

// In some versions of OpenCV the class is in no namespace.
using namespace cv;          // NOLINT(google-build-using-namespace)
using namespace cv::detail;  // NOLINT(google-build-using-namespace)
using Graph = GCGraph<float>;

}  // namespace

void MinimumCut::add_penalty(int zero, int one, float penalty) {
  if (penalty > 0) penalties_.push_back({zero, one, penalty});
}

std::vector<std::uint8_t> MinimumCut::solve() const {
  std::vector<std::uint8_t> x(cost_.size());
  if (penalties_.empty()) {  // the graph's solver refuses one without edges
    std::transform(cost_.begin(), cost_.end(), x.begin(), [](float c) { return c < 0 ? 1 : 0; });
    return x;
  }
  Graph graph;
  graph.create(static_cast<unsigned>(cost_.size()), static_cast<unsigned>(2 * penalties_.size() + 2));
  for (const float cost : cost_) {
    const int node = graph.addVtx();
    // The source's side is 0: a node on the sink's pays its weight from the source.
    graph.addTermWeights(node, std::max(0.0F, cost), std::max(0.0F, -cost));
  }
  for (const Penalty& p : penalties_) graph.addEdges(p.zero, p.one, p.value, 0.0F);
  graph.maxFlow();
  for (std::size_t n = 0; n < x.size(); ++n) x[n] = graph.inSourceSegment(static_cast<int>(n)) ? 0 : 1;
  return x;
}

}  // namespace gyre
