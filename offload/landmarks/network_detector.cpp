// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/network_detector.h"

#include "offload/landmarks/skeleton.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <optional>

namespace gyre {

namespace {

constexpr std::size_t most_views = 40;
constexpr int views_a_landmark = 3;
constexpr double seen = 0.3;

// What of the picture shows the subject; nothing when less than half of it is inside.
std::optional<cv::Rect2d> subject_box(const Subject& subject, const LandmarkView& view) {
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  std::size_t inside = 0, all = 0;
  for (const Eigen::Vector3d& node : subject.figure.graph.nodes) {
    ++all;
    const auto pixel = view.project(node);
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > view.camera.width || pixel->y() > view.camera.height)
      continue;
    ++inside;
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  if (2 * inside < all) return std::nullopt;
  return cv::Rect2d(low.x(), low.y(), high.x() - low.x(), high.y() - low.y());
}

}  // namespace

Result<Detections> NetworkDetector::detect(const Subject& subject, const Progress& progress) {
  struct Shown {
    int view;
    cv::Rect2d box;
  };
  std::vector<Shown> shown;
  for (std::size_t i = 0; i < subject.views.size(); ++i)
    if (const auto box = subject_box(subject, subject.views[i])) shown.push_back({static_cast<int>(i), *box});
  std::vector<Skeleton> skeletons;
  const std::size_t count = std::min(shown.size(), most_views);
  for (std::size_t k = 0; k < count; ++k) {
    progress(static_cast<double>(k) / static_cast<double>(count), "keypoints");
    const auto& [view, box] = shown[k * shown.size() / count];
    const cv::Mat picture =
        cv::imread(subject.views[view].picture.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (picture.empty()) continue;
    auto keypoints = network_.keypoints(picture, box);
    if (!keypoints) return tl::unexpected(keypoints.error());
    Skeleton skeleton{view, std::move(*keypoints)};
    if (is_person(skeleton, network_.layout())) skeletons.push_back(std::move(skeleton));
  }

  Detections found;
  for (const LandmarkGroup& group : choose_views(skeletons, network_.layout(), views_a_landmark))
    for (const NamedKeypoint& point : group.points) {
      found.missing[point.name] = skeletons.empty() ? "the network sees nobody in the pictures"
                                                    : "no picture shows it to the network from the right side";
      for (const int s : group.skeletons) {
        PixelDetection detection{point.name, skeletons[s].view, Eigen::Vector2d::Zero(), 0};
        double least = 1;
        const auto n = static_cast<double>(point.indices.size());
        for (const int i : point.indices) {
          const Keypoint& keypoint = skeletons[s].keypoints[i];
          detection.pixel += keypoint.pixel / n;
          detection.deviation += (1.0 + keypoint.deviation) / n;
          least = std::min(least, keypoint.confidence);
        }
        if (least < seen) continue;
        found.pixels.push_back(detection);
      }
    }
  for (const PixelDetection& detection : found.pixels) found.missing.erase(detection.name);
  return found;
}

}  // namespace gyre
