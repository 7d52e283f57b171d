// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/face_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

struct RankedView {
  int view = 0;
  double score = 0.0;
  double resolution = 0.0;
};

// How well the views show the face, the best first; sharpness is looked at later.
std::vector<RankedView> rank_views(const Subject& subject, const FaceFrame& frame, const FaceViewRange& range) {
  std::vector<RankedView> ranked;
  const Eigen::Isometry3d face_from_world = frame.world_from_face.inverse();
  const Eigen::Vector3d middle(0, 0.02, -0.03);
  for (std::size_t i = 0; i < subject.views.size(); ++i) {
    const LandmarkView& view = subject.views[i];
    const Eigen::Vector3d to_camera = face_from_world * view.centre() - middle;
    const double distance = to_camera.norm();
    const double yaw = std::atan2(to_camera.x(), to_camera.z());
    const double pitch = std::atan2(to_camera.y(), std::hypot(to_camera.x(), to_camera.z()));
    if (std::abs(yaw) > range.yaw || pitch < range.low || pitch > range.high) continue;
    bool inside = true;
    for (const auto& [x, y] : {std::pair{-0.05, -0.06}, {0.05, -0.06}, {-0.05, 0.06}, {0.05, 0.06}}) {
      const auto pixel = view.project(frame.world_from_face * Eigen::Vector3d(x, y, -0.03));
      inside = inside && pixel && pixel->x() > 2 && pixel->y() > 2 && pixel->x() < view.camera.width - 2 &&
               pixel->y() < view.camera.height - 2;
    }
    if (!inside) continue;
    const double resolution = view.camera.fx / distance;
    const double frontality = std::exp(-0.5 * (std::pow(yaw / 0.3, 2) + std::pow((pitch - range.best_pitch) / 0.3, 2)));
    ranked.push_back({static_cast<int>(i), resolution * frontality, resolution});
  }
  std::sort(ranked.begin(), ranked.end(), [](const RankedView& a, const RankedView& b) {
    return std::pair(-a.score, a.view) < std::pair(-b.score, b.view);
  });
  return ranked;
}

// Variance of the Laplacian of what a map shows; blurred pictures have little.
double sharpness(const cv::Mat& picture, const cv::Mat& known) {
  cv::Mat grey, laplacian;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, grey, {}, 1.5);
  cv::Laplacian(grey, laplacian, CV_32F, 3);
  cv::Scalar mean, deviation;
  cv::Mat inner;
  cv::erode(known, inner, cv::getStructuringElement(cv::MORPH_RECT, {11, 11}));
  cv::meanStdDev(laplacian, mean, deviation, inner);
  return deviation[0] * deviation[0];
}

}  // namespace

FaceMap make_face_map(const Subject& subject, const FaceFrame& frame, const std::vector<Eigen::Vector3d>& head,
                      const FaceViewRange& range) {
  FaceMap map;
  std::vector<Eigen::Vector3d> front;
  const Eigen::Isometry3d face_from_world = frame.world_from_face.inverse();
  for (const Eigen::Vector3d& p : head)
    if ((face_from_world * p).z() > -0.12) front.push_back(p);
  map.relief = make_relief(front, frame.world_from_face);

  const int columns = static_cast<int>(std::lround((map.high.x() - map.low.x()) / FaceMap::cell));
  const int rows = static_cast<int>(std::lround((map.high.y() - map.low.y()) / FaceMap::cell));
  std::vector<Eigen::Vector3d> surface(static_cast<std::size_t>(columns) * rows);
  cv::Mat known(rows, columns, CV_8U, cv::Scalar(0));
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const Eigen::Vector3d p = map.relief.world_point(map.place(c, r));
      if (!p.allFinite()) continue;
      surface[static_cast<std::size_t>(r) * columns + c] = p;
      known.at<std::uint8_t>(r, c) = 255;
    }
  if (cv::countNonZero(known) < columns * rows / 4) return map;

  struct Shown {
    RankedView candidate;
    cv::Mat picture;
    double sharp = 0;
  };
  std::vector<Shown> shown;
  std::vector<RankedView> ranked = rank_views(subject, frame, range);
  if (ranked.size() > static_cast<std::size_t>(2 * range.count)) ranked.resize(2 * range.count);
  for (const RankedView& candidate : ranked) {
    if (candidate.score < 0.2 * ranked.front().score) break;
    const LandmarkView& view = subject.views[candidate.view];
    const cv::Mat picture = cv::imread(view.picture.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (picture.empty() || picture.cols != view.camera.width || picture.rows != view.camera.height) continue;
    cv::Mat at(rows, columns, CV_32FC2, cv::Scalar(-1, -1));
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        if (known.at<std::uint8_t>(r, c) == 0) continue;
        const auto pixel = view.project(surface[static_cast<std::size_t>(r) * columns + c]);
        if (pixel)
          at.at<cv::Vec2f>(r, c) = {static_cast<float>(pixel->x() - 0.5), static_cast<float>(pixel->y() - 0.5)};
      }
    Shown one{candidate, {}, 0};
    cv::remap(picture, one.picture, at, {}, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
    one.picture.convertTo(one.picture, CV_32FC3);
    one.sharp = sharpness(one.picture, known);
    shown.push_back(one);
  }
  if (shown.empty()) return map;
  double sharpest = 0;
  for (const Shown& one : shown) sharpest = std::max(sharpest, one.sharp);
  std::erase_if(shown, [&](const Shown& one) { return one.sharp < 0.35 * sharpest; });
  if (shown.size() > static_cast<std::size_t>(range.count)) shown.resize(range.count);

  const cv::Scalar level = cv::mean(shown.front().picture, known);
  double weights = 0;
  map.mean = cv::Mat::zeros(rows, columns, CV_32FC3);
  for (Shown& one : shown) {
    const cv::Scalar own = cv::mean(one.picture, known);
    const cv::Scalar gain(level[0] / std::max(own[0], 1.0), level[1] / std::max(own[1], 1.0),
                          level[2] / std::max(own[2], 1.0));
    cv::multiply(one.picture, gain, one.picture);
    map.views.push_back(one.candidate.view);
    map.pictures.push_back(one.picture);
    map.weights.push_back(one.candidate.score);
    map.mean += one.picture * one.candidate.score;
    weights += one.candidate.score;
  }
  map.mean /= weights;
  map.resolution = shown.front().candidate.resolution;
  return map;
}

std::optional<Eigen::Vector3d> sweep_depth(const Subject& subject, const FaceMap& map, const Eigen::Vector2d& place) {
  constexpr int side = 15;  // cells of a patch: 7.5 mm
  constexpr double limit = 0.006, step = 0.0005;
  const Eigen::Vector3d on_relief(place.x(), place.y(), map.relief.at(place));
  if (!on_relief.allFinite() || map.views.size() < 3) return std::nullopt;
  // A point before the relief appears beside its place, by its offset times the slope of the ray.
  std::vector<Eigen::Vector2d> slopes;
  std::vector<cv::Mat> greys;
  Eigen::Vector2d mean_slope(0, 0);
  double weights = 0;
  for (std::size_t i = 0; i < map.views.size(); ++i) {
    const Eigen::Vector3d centre = map.relief.world_from_relief.inverse() * subject.views[map.views[i]].centre();
    const Eigen::Vector3d ray = centre - on_relief;
    slopes.emplace_back(ray.x() / ray.z(), ray.y() / ray.z());
    mean_slope += map.weights[i] * slopes.back();
    weights += map.weights[i];
    cv::Mat grey;
    cv::cvtColor(map.pictures[i], grey, cv::COLOR_BGR2GRAY);
    greys.push_back(grey);
  }
  mean_slope /= weights;
  const auto agreement = [&](double offset) {
    std::vector<cv::Mat> patches;
    for (std::size_t i = 0; i < greys.size(); ++i) {
      const cv::Point2d at = map.pixel(place + offset * (mean_slope - slopes[i]));
      cv::Mat patch;
      cv::getRectSubPix(greys[i], {side, side}, cv::Point2f(at), patch);
      cv::Scalar mean, deviation;
      cv::meanStdDev(patch, mean, deviation);
      patches.push_back((patch - mean[0]) / std::max(deviation[0], 1.0));
    }
    double sum = 0, pairs = 0;
    for (std::size_t i = 0; i < patches.size(); ++i)
      for (std::size_t j = i + 1; j < patches.size(); ++j, ++pairs) sum += patches[i].dot(patches[j]) / (side * side);
    return sum / pairs;
  };
  std::vector<double> values;
  for (double offset = -limit; offset <= limit + 1e-9; offset += step) values.push_back(agreement(offset));
  const auto best = static_cast<int>(std::max_element(values.begin(), values.end()) - values.begin());
  constexpr int beside = 3;  // steps: what the peak must stand out against
  const int last = static_cast<int>(values.size()) - 1;
  if (best < beside || best > last - beside || values[best] < 0.6 ||
      values[best] - std::max(values[best - beside], values[best + beside]) < 0.01)
    return std::nullopt;
  const double before = values[best - 1], after = values[best + 1], bend = before - 2 * values[best] + after;
  const double offset = -limit + step * (best + (bend < 0 ? 0.5 * (before - after) / bend : 0.0));
  return map.relief.world_from_relief * Eigen::Vector3d(place.x() + offset * mean_slope.x(),
                                                        place.y() + offset * mean_slope.y(), on_relief.z() + offset);
}

std::vector<PixelDetection> detections_of(const Subject& subject, const FaceMap& map, const std::string& name,
                                          const Eigen::Vector2d& place, double deviation) {
  constexpr int half = 14, reach = 6;  // cells: patches of 14 mm, moved by up to 3 mm
  constexpr float alike = 0.5F;
  std::vector<PixelDetection> detections;
  const cv::Point2d at = map.pixel(place);
  const cv::Rect patch(static_cast<int>(std::lround(at.x)) - half, static_cast<int>(std::lround(at.y)) - half,
                       2 * half + 1, 2 * half + 1);
  const cv::Rect window(patch.x - reach, patch.y - reach, patch.width + 2 * reach, patch.height + 2 * reach);
  const cv::Rect whole(0, 0, map.mean.cols, map.mean.rows);
  const bool inside = (window & whole) == window;
  for (std::size_t i = 0; i < map.views.size(); ++i) {
    Eigen::Vector2d shift(0, 0);
    if (inside) {
      cv::Mat likeness;
      cv::matchTemplate(map.pictures[i](window), map.mean(patch), likeness, cv::TM_CCOEFF_NORMED);
      double best = 0;
      cv::Point where;
      cv::minMaxLoc(likeness, nullptr, &best, nullptr, &where);
      if (best < alike) continue;
      // On the rim the true maximum may lie beyond.
      const bool rim = where.x == 0 || where.y == 0 || where.x == 2 * reach || where.y == 2 * reach;
      if (!rim) shift = FaceMap::cell * Eigen::Vector2d(where.x - reach, reach - where.y);
    }
    const LandmarkView& view = subject.views[map.views[i]];
    const Eigen::Vector3d world = map.relief.world_point(place + shift);
    if (!world.allFinite()) continue;
    const auto pixel = view.project(world);
    if (!pixel) continue;
    const double per_metre = view.camera.fx / (world - view.centre()).norm();
    detections.push_back({name, map.views[i], *pixel, std::max(deviation * per_metre, 0.7)});
  }
  return detections;
}

}  // namespace gyre
