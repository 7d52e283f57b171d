// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/view_effects.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// Items as runs of the grouped measurements.
template <class Visit>
void for_each_item(std::span<const Measurement> measurements, Visit&& visit) {
  for (std::size_t first = 0; first < measurements.size();) {
    std::size_t last = first;
    while (last < measurements.size() && measurements[last].item == measurements[first].item) ++last;
    if (last - first > 1) visit(first, last);
    first = last;
  }
}

// Too dark or too bright values say little about a gain.
bool usable_for_gain(const Eigen::Vector3f& bgr) {
  return bgr.minCoeff() > 12.0F && bgr.maxCoeff() < 248.0F;
}

}  // namespace

std::vector<double> view_effects(std::span<const Measurement> measurements, int views, double scale, double prior) {
  Eigen::VectorXd effect = Eigen::VectorXd::Zero(views);
  std::vector<double> weight(measurements.size(), 1.0);
  constexpr int rounds = 4;  // of reweighting
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixXd normal = prior * Eigen::MatrixXd::Identity(views, views);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(views);
    for_each_item(measurements, [&](std::size_t first, std::size_t last) {
      double total = 0;
      double mean = 0;
      for (std::size_t i = first; i < last; ++i) {
        total += weight[i];
        mean += weight[i] * measurements[i].value;
      }
      mean /= total;
      for (std::size_t i = first; i < last; ++i) {
        const int u = measurements[i].view;
        normal(u, u) += weight[i];
        right[u] += weight[i] * (measurements[i].value - mean);
        for (std::size_t j = first; j < last; ++j) normal(u, measurements[j].view) -= weight[i] * weight[j] / total;
      }
    });
    effect = normal.ldlt().solve(right);
    for_each_item(measurements, [&](std::size_t first, std::size_t last) {
      double total = 0;
      double mean = 0;
      for (std::size_t i = first; i < last; ++i) {
        total += weight[i];
        mean += weight[i] * (measurements[i].value - effect[measurements[i].view]);
      }
      mean /= total;
      for (std::size_t i = first; i < last; ++i) {
        const double residual = std::abs(measurements[i].value - effect[measurements[i].view] - mean);
        weight[i] = residual > scale ? scale / residual : 1.0;
      }
    });
  }
  return {effect.data(), effect.data() + effect.size()};
}

std::vector<Eigen::Vector3d> exposure_gains(const ObservationTable& table, int photos) {
  std::vector<Eigen::Vector3d> gains(photos, Eigen::Vector3d::Ones());
  for (int c = 0; c < 3; ++c) {
    std::vector<Measurement> logs;
    for (std::size_t t = 0; t + 1 < table.start.size(); ++t) {
      for (const Observation& o : table.of(t)) {
        if (o.quality != ViewQuality::strict || !usable_for_gain(o.colour)) continue;
        logs.push_back({static_cast<int>(t), o.photo, std::log(linear_from_encoded(o.colour[c]))});
      }
    }
    const std::vector<double> effects = view_effects(logs, photos, 0.05, 10.0);
    for (int p = 0; p < photos; ++p) gains[p][c] = std::exp(-effects[p]);
  }
  return gains;
}

std::vector<double> relative_sharpness(const ObservationTable& table, std::span<const Photo> photos) {
  std::vector<double> factor(photos.size(), 1.0);
  for (const bool head : {false, true}) {
    std::vector<Measurement> details;
    for (std::size_t t = 0; t + 1 < table.start.size(); ++t) {
      for (const Observation& o : table.of(t)) {
        if (o.quality != ViewQuality::strict || photos[o.photo].head_pass != head) continue;
        details.push_back({static_cast<int>(t), o.photo, o.detail});
      }
    }
    const std::vector<double> effects = view_effects(details, static_cast<int>(photos.size()), 0.5, 10.0);
    std::vector<double> of_pass;
    for (std::size_t p = 0; p < photos.size(); ++p) {
      if (photos[p].head_pass == head) of_pass.push_back(effects[p]);
    }
    if (of_pass.empty()) continue;
    std::nth_element(of_pass.begin(), of_pass.begin() + of_pass.size() / 2, of_pass.end());
    const double median = of_pass[of_pass.size() / 2];
    for (std::size_t p = 0; p < photos.size(); ++p) {
      // Effects are of energy, a squared amplitude.
      if (photos[p].head_pass == head) factor[p] = std::clamp(std::exp(0.5 * (effects[p] - median)), 0.1, 1.0);
    }
  }
  return factor;
}

}  // namespace gyre
