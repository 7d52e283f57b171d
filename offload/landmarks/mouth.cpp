// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/mouth.h"

#include "common/geometry/quantile.h"
#include "offload/landmarks/figure.h"
#include "offload/landmarks/skin.h"
#include "offload/landmarks/squared.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace gyre {

namespace {

using Eigen::Vector2d;

int cells(double metres) {
  return static_cast<int>(std::lround(metres / FaceMap::cell));
}

// The path from left to right with the largest sum of `strength`, that changes its row by at most one a column.
std::vector<int> best_path(const cv::Mat& strength, float bend) {
  const int rows = strength.rows, columns = strength.cols;
  cv::Mat sum(rows, columns, CV_32F), from(rows, columns, CV_32S, cv::Scalar(0));
  strength.col(0).copyTo(sum.col(0));
  for (int c = 1; c < columns; ++c)
    for (int r = 0; r < rows; ++r) {
      float best = -std::numeric_limits<float>::infinity();
      for (int d = -1; d <= 1; ++d) {
        if (r + d < 0 || r + d >= rows) continue;
        const float value = sum.at<float>(r + d, c - 1) - (d == 0 ? 0 : bend);
        if (value <= best) continue;
        best = value;
        from.at<int>(r, c) = r + d;
      }
      sum.at<float>(r, c) = best + strength.at<float>(r, c);
    }
  std::vector<int> path(columns);
  double unused = 0;
  cv::Point end;
  cv::minMaxLoc(sum.col(columns - 1), nullptr, &unused, nullptr, &end);
  path[columns - 1] = end.y;
  for (int c = columns - 1; c > 0; --c) path[c - 1] = from.at<int>(path[c], c);
  return path;
}

}  // namespace

tl::expected<FeaturePair, std::string> find_mouth_corners(const FaceMap& map, double line, double scale) {
  const cv::Mat lab = lab_of(map, 0.0008);
  const int half = cells(0.040 * scale), height = cells(0.008), band = cells(0.0022);
  const cv::Point2d middle = map.pixel({0, line});
  const cv::Rect area(static_cast<int>(std::lround(middle.x)) - half, static_cast<int>(std::lround(middle.y)) - height,
                      2 * half + 1, 2 * height + 1);
  const cv::Rect reachable(area.x, area.y - 3 * band, area.width, area.height + 6 * band);
  if ((reachable & cv::Rect(0, 0, lab.cols, lab.rows)) != reachable)
    return tl::unexpected(std::string("the mouth lies outside of what the cloud shows of the face"));
  const cv::Vec3f cheek_left = median_colour(map, lab, {0.030 * scale, line - 0.005}, {0.045 * scale, line + 0.015}),
                  cheek_right = median_colour(map, lab, {-0.045 * scale, line - 0.005}, {-0.030 * scale, line + 0.015});
  const float skin_red = 0.5F * (cheek_left[1] + cheek_right[1]);

  cv::Mat valley(area.height, area.width, CV_32F);
  for (int r = 0; r < area.height; ++r)
    for (int c = 0; c < area.width; ++c) {
      const auto at = [&](int dr) { return lab.at<cv::Vec3f>(area.y + r + dr, area.x + c)[0]; };
      valley.at<float>(r, c) = std::max(0.0F, std::min(at(-band), at(band)) - at(0));
    }
  cv::blur(valley, valley, {cells(0.002) | 1, 1});
  const std::vector<int> path = best_path(valley, 0.4F);

  std::vector<double> depth(area.width), red(area.width), depths, reds;
  for (int c = 0; c < area.width; ++c) {
    depth[c] = valley.at<float>(path[c], c);
    double sum = 0;
    int count = 0;
    for (int dr = -2 * band; dr <= 2 * band; ++dr, ++count)
      sum += lab.at<cv::Vec3f>(area.y + path[c] + dr, area.x + c)[1] - skin_red;
    red[c] = sum / count;
    if (std::abs(c - half) > cells(0.012 * scale)) continue;
    depths.push_back(depth[c]);
    reds.push_back(red[c]);
  }
  const double usual_depth = median(depths), usual_red = median(reds);
  const bool has_line = usual_depth > 1.5, has_red = usual_red > 2.5;
  if (!has_line && !has_red) return tl::unexpected(std::string("the lips cannot be told from the skin around"));
  // How much a column is mouth: positive inside, negative outside.
  std::vector<double> mouth(area.width);
  for (int c = 0; c < area.width; ++c) {
    const double by_line = has_line ? std::min(depth[c] / usual_depth, 1.5) : 0,
                 by_red = has_red ? std::clamp(red[c] / usual_red, -0.5, 1.5) : 0;
    // The line goes on into the shadow of the cheeks' folds, the red ends with the lips.
    const double line_share = has_line ? (has_red ? 0.35 : 1.0) : 0.0;
    mouth[c] = line_share * by_line + (1 - line_share) * by_red - 0.42;
  }
  const auto end = [&](int sign, std::optional<double> near) {
    double sum = 0, best = -std::numeric_limits<double>::infinity();
    int where = 0;
    for (int w = 0; w <= half; ++w) {
      sum += sign == 0 ? 0.5 * (mouth[half + w] + mouth[half - w]) : mouth[half + sign * w];
      const double x = w * FaceMap::cell;
      if (x < 0.015 * scale || x > 0.036 * scale) continue;
      const double expected = near ? *near : 0.025 * scale, spread = near ? 0.0015 : 0.004 * scale;
      const double score = sum - 0.75 * squared((x - expected) / spread);
      if (score <= best) continue;
      best = score;
      where = w;
    }
    return where;
  };
  const double shared = end(0, std::nullopt) * FaceMap::cell;
  FeaturePair corners;
  for (const int sign : {1, -1}) {
    const int c = half + sign * end(sign, shared);
    corners.place[sign > 0 ? 0 : 1] = map.place(area.x + c, area.y + path[c]);
  }
  corners.deviation = 0.002 + 0.6 / std::max(map.resolution, 100.0);
  return corners;
}

tl::expected<FeaturePair, std::string> find_nostrils(const FaceMap& map, double base, double tip, double scale) {
  cv::Mat lightness, around;
  cv::extractChannel(lab_of(map, 0.0012), lightness, 0);
  cv::GaussianBlur(lightness, around, {}, 0.004 / FaceMap::cell);
  struct Spot {
    Vector2d place;
    double contrast;
  };
  const auto spots = [&](double sign) {
    std::vector<Spot> found;
    for (double y = base - 0.003; y <= tip - 0.003; y += FaceMap::cell)
      for (double x = 0.0035 * scale; x <= 0.014 * scale; x += FaceMap::cell) {
        const cv::Point at(map.pixel({sign * x, y}));
        if (at.x < 1 || at.y < 1 || at.x >= lightness.cols - 1 || at.y >= lightness.rows - 1) continue;
        const float here = lightness.at<float>(at);
        bool darkest = here > 1;
        for (int dr = -1; dr <= 1; ++dr)
          for (int dc = -1; dc <= 1; ++dc) darkest = darkest && here <= lightness.at<float>(at.y + dr, at.x + dc);
        if (darkest) found.push_back({{sign * x, y}, around.at<float>(at) - here});
      }
    return found;
  };
  std::optional<FeaturePair> best;
  double most = 5;  // in L
  for (const Spot& left : spots(1))
    for (const Spot& right : spots(-1)) {
      const double score = std::min(left.contrast, right.contrast) -
                           squared((left.place.x() + right.place.x()) / 0.002) -
                           squared((left.place.y() - right.place.y()) / 0.0015);
      if (score <= most) continue;
      most = score;
      best = FeaturePair{{left.place, right.place}, 0.002 + 0.6 / std::max(map.resolution, 100.0)};
    }
  if (!best) return tl::unexpected(std::string("no picture shows the nostrils"));
  return *best;
}

}  // namespace gyre
