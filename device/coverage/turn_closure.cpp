// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/turn_closure.h"

#include "common/geometry/quantile.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr int patch = 9;  // pixels, in which a change is looked for

cv::Mat smoothed(const cv::Mat& luma) {
  cv::Mat smooth;
  cv::blur(luma, smooth, {3, 3});
  return smooth;
}

// In the upright strip that a framed subject stands in.
void detect(const cv::Mat& luma, std::vector<cv::KeyPoint>& points, cv::Mat& descriptors) {
  constexpr double half_width = 0.3;  // of the shorter side
  constexpr int most = 400;
  constexpr float scale = 1.2F;
  constexpr int levels = 3;
  constexpr int edge = 15;  // half a feature: the pictures are small
  const int half = static_cast<int>(std::lround(half_width * std::min(luma.cols, luma.rows)));
  cv::Mat strip = cv::Mat::zeros(luma.size(), CV_8U);
  strip.colRange(luma.cols / 2 - half, luma.cols / 2 + half).setTo(255);
  const auto orb = cv::ORB::create(most, scale, levels, edge, 0, 2, cv::ORB::HARRIS_SCORE, 2 * edge + 1, 8);
  orb->detectAndCompute(luma, strip, points, descriptors);
}

// Without the lowest and the highest quarter.
double trimmed_mean(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t cut = values.size() / 4;
  double sum = 0.0;
  for (std::size_t i = cut; i < values.size() - cut; ++i) sum += values[i];
  return sum / static_cast<double>(values.size() - 2 * cut);
}

}  // namespace

void TurnClosure::remember(const cv::Mat& luma) {
  camera_ = camera_.scaled(static_cast<double>(luma.cols) / camera_.width);
  first_ = smoothed(luma);
  detect(luma, points_, descriptors_);
  gone_.assign(points_.size(), 0);
}

// Whether the picture around each point is another one than in the first view.
std::vector<bool> TurnClosure::changed(const cv::Mat& luma) const {
  constexpr double levels = 14.0;
  cv::Mat difference;
  cv::absdiff(first_, smoothed(luma), difference);
  cv::blur(difference, difference, {patch, patch});
  std::vector<bool> is_changed;
  is_changed.reserve(points_.size());
  for (const cv::KeyPoint& point : points_)
    is_changed.push_back(difference.at<unsigned char>(cv::Point(point.pt)) > levels);
  return is_changed;
}

// How far those points have turned about the subject's axis, radians, counter-clockwise seen from above, when they are
// seen again. Told from how far the front of the body, taken to be as thick as usual, has gone to a side: exact at
// none.
std::optional<double> TurnClosure::turn_to(const cv::Mat& luma, const std::vector<bool>& of) const {
  constexpr float ratio = 0.8F;        // Lowe, IJCV 2004
  constexpr std::size_t enough = 12;   // points that agree, ...
  constexpr double share = 0.5;        // ... of all that are like one in the picture, ...
  constexpr double most = 0.25;        // ... and of all
  constexpr double thickness = 0.055;  // half of the body's, of the distance to its axis
  constexpr double farthest = 0.5;     // radians
  constexpr double sway = 5.0;         // pixels up and down
  cv::Mat those;
  std::vector<cv::Point2f> then;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!of[i]) continue;
    those.push_back(descriptors_.row(static_cast<int>(i)));
    then.push_back(points_[i].pt);
  }
  std::vector<cv::KeyPoint> now;
  cv::Mat descriptors;
  detect(luma, now, descriptors);
  if (then.size() < enough || now.size() < enough) return std::nullopt;
  std::vector<std::vector<cv::DMatch>> pairs;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(those, descriptors, pairs, 2);
  const double way = thickness * camera_.fx;  // of the front, pixels a radian
  std::vector<double> across;
  for (const cv::Point2f& point : then) across.push_back(point.x);
  const double middle = median(std::move(across));
  std::vector<double> ways, front, outline;
  std::size_t alike = 0;
  for (const std::vector<cv::DMatch>& pair : pairs) {
    if (pair.size() < 2 || pair[0].distance > ratio * pair[1].distance) continue;
    ++alike;
    const cv::Point2f by =
        now[static_cast<std::size_t>(pair[0].trainIdx)].pt - then[static_cast<std::size_t>(pair[0].queryIdx)];
    if (std::abs(by.y) < sway && std::abs(by.x) < farthest * way) {
      ways.push_back(by.x);
      const double aside = std::abs(then[static_cast<std::size_t>(pair[0].queryIdx)].x - middle);
      if (aside < 0.6 * way) front.push_back(by.x);
      if (aside > 0.9 * way) outline.push_back(by.x);
    }
  }
  const auto agree = static_cast<double>(ways.size());
  if (ways.size() < enough || agree < share * static_cast<double>(alike) ||
      agree < most * static_cast<double>(then.size())) {
    return std::nullopt;
  }
  // A turn moves the front and not the outline; swaying moves both.
  if (front.size() < enough / 2 || outline.size() < enough / 2) return std::nullopt;
  return (trimmed_mean(std::move(front)) - trimmed_mean(std::move(outline))) / (0.9 * way);
}

std::vector<bool> TurnClosure::subjects() const {
  constexpr double nearly_all = 0.85;
  std::vector<bool> is_subjects;
  is_subjects.reserve(gone_.size());
  for (const int looks : gone_) is_subjects.push_back(looks >= nearly_all * looks_);
  return is_subjects;
}

void TurnClosure::look(const cv::Mat& luma) {
  constexpr int often = 3;              // looks in a row that find them turned away, and ...
  constexpr int enough = 8;             // ... looks at them that tell the room's points
  constexpr std::ptrdiff_t least = 20;  // points of the subject
  constexpr double near = 0.045;        // radians from where they began
  if (!is_away_) {
    const std::vector<bool> gone = changed(luma);
    const bool is_gone = std::count(gone.begin(), gone.end(), true) >= least && !turn_to(luma, gone);
    looks_away_ = is_gone ? looks_away_ + 1 : 0;
    if (looks_away_ < often) return;
    is_away_ = true;
  }
  const std::optional<double> turn = looks_ < enough ? std::nullopt : turn_to(luma, subjects());
  if (!turn) {
    const std::vector<bool> gone = changed(luma);
    for (std::size_t i = 0; i < gone.size(); ++i) gone_[i] += gone[i] ? 1 : 0;
    ++looks_;
  }
  // One look may take somebody's back for their front; two do not. Between them they may have gone past.
  if (turn && seen_) is_closed_ = std::abs(*turn) < near || (*turn > 0.0) != (*seen_ > 0.0);
  seen_ = turn;
}

bool TurnClosure::add(const cv::Mat& luma, bool is_sharp) {
  constexpr int every = 4;  // frames: a look costs as much as all the rest
  if (first_.empty()) {
    remember(luma);
  } else if (!is_closed_ && is_sharp && (++frames_ >= every || seen_)) {
    frames_ = 0;
    look(luma);
  }
  return is_closed_;
}

}  // namespace gyre
