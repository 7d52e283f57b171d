// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/still_background.h"

#include "common/parallel/parallel.h"

#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr float far_beyond = 1e4F;  // metres

cv::Mat grey_of(const StereoView& view) {
  const QuadImage& image = view.levels.front().image;
  cv::Mat grey(image.height, image.width, CV_32F);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) grey.at<float>(y, x) = image.value(x, y);
  return grey;
}

// Of the given views of one size all but `self`, evenly spread, at most `most`.
std::vector<int> others_of(const std::vector<int>& members, int self, int most) {
  std::vector<int> others;
  std::copy_if(members.begin(), members.end(), std::back_inserter(others), [&](int other) { return other != self; });
  if (static_cast<int>(others.size()) <= most) return others;
  std::vector<int> spread;
  for (int i = 0; i < most; ++i) spread.push_back(others[i * others.size() / static_cast<std::size_t>(most)]);
  return spread;
}

}  // namespace

std::vector<std::vector<char>> still_background(std::span<const StereoView> views,
                                                const StillBackgroundOptions& options, int threads) {
  struct Patches {
    cv::Mat grey, mean, variance;
  };
  const cv::Size window(options.window, options.window);
  const double noise_variance = options.noise * options.noise;
  std::map<std::pair<std::string, std::pair<int, int>>, std::vector<int>> passes;
  std::vector<std::vector<int>*> members(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    members[i] = &passes[{pass_of(views[i]), {views[i].width(), views[i].height()}}];
    members[i]->push_back(static_cast<int>(i));
  }
  std::vector<Patches> patches(views.size());
  parallel_for(views.size(), threads, [&](std::size_t i) {
    Patches& p = patches[i];
    p.grey = grey_of(views[i]);
    cv::boxFilter(p.grey, p.mean, CV_32F, window);
    cv::boxFilter(p.grey.mul(p.grey), p.variance, CV_32F, window);
    p.variance = p.variance - p.mean.mul(p.mean) + noise_variance;
  });
  std::vector<std::vector<char>> still(views.size());
  parallel_for(views.size(), threads, [&](std::size_t i) {
    const std::vector<int> others = others_of(*members[i], static_cast<int>(i), options.compared);
    cv::Mat count(patches[i].grey.size(), CV_32S, cv::Scalar(0));
    for (const int other : others) {
      const Patches& a = patches[i];
      const Patches& b = patches[static_cast<std::size_t>(other)];
      cv::Mat covariance, norm;
      cv::boxFilter(a.grey.mul(b.grey), covariance, CV_32F, window);
      covariance -= a.mean.mul(b.mean);
      cv::sqrt(a.variance.mul(b.variance), norm);
      cv::add(count, 1, count, covariance > options.min_correlation * norm);
    }
    const double needed = std::max(3.0, options.min_share * static_cast<double>(others.size()));
    still[i].resize(count.total());
    for (int y = 0; y < count.rows; ++y)
      for (int x = 0; x < count.cols; ++x) still[i][views[i].index(x, y)] = count.at<int>(y, x) >= needed ? 1 : 0;
  });
  return still;
}

void put_beyond(StereoDepth& map, const std::vector<char>& still) {
  for (std::size_t i = 0; i < still.size(); ++i) {
    if (still[i] == 0) continue;
    map.state[i] = PixelState::beyond;
    map.depth[i] = far_beyond;
  }
}

}  // namespace gyre
