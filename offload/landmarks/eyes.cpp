// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/eyes.h"

#include "offload/landmarks/skin.h"
#include "offload/landmarks/squared.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace gyre {

namespace {

using Eigen::Vector2d;

float sample(const FaceMap& map, const cv::Mat& picture, const Vector2d& place) {
  const cv::Point2d at = map.pixel(place);
  const int c = static_cast<int>(std::lround(at.x)), r = static_cast<int>(std::lround(at.y));
  if (c < 0 || r < 0 || c >= picture.cols || r >= picture.rows) return 0;
  return picture.at<float>(r, c);
}

struct Iris {
  Vector2d centre = Vector2d::Zero();
  double contrast = 0.0;  // in L
};

// How much darker a disc is than both of its sides; lids may cover its top and bottom.
double iris_contrast(const FaceMap& map, const cv::Mat& lightness, const Vector2d& centre, double radius) {
  double inside = 0;
  double sides[2] = {0, 0};
  int count = 0;
  for (int a = -30; a <= 30; a += 10) {
    const double angle = a * M_PI / 180;
    for (int side = 0; side < 2; ++side) {
      const Vector2d out(side == 0 ? std::cos(angle) : -std::cos(angle), std::sin(angle));
      inside += 0.5 * (sample(map, lightness, centre + 0.5 * radius * out) +
                       sample(map, lightness, centre + 0.85 * radius * out));
      sides[side] += 0.5 * (sample(map, lightness, centre + 1.2 * radius * out) +
                            sample(map, lightness, centre + 1.4 * radius * out));
    }
    ++count;
  }
  return std::min(sides[0], sides[1]) / count - inside / (2 * count);
}

std::vector<Iris> iris_candidates(const FaceMap& map, const cv::Mat& lightness, double sign, double scale) {
  std::vector<Iris> all;
  for (double y = 0.018 * scale; y <= 0.062 * scale; y += 0.001)
    for (double x = 0.020 * scale; x <= 0.046 * scale; x += 0.001) {
      Iris iris{{sign * x, y}, 0};
      for (const double radius : {0.0053, 0.0059, 0.0065})
        iris.contrast = std::max(iris.contrast, iris_contrast(map, lightness, iris.centre, radius));
      if (iris.contrast > 3) all.push_back(iris);
    }
  std::sort(all.begin(), all.end(), [](const Iris& a, const Iris& b) { return a.contrast > b.contrast; });
  if (all.size() > 80) all.resize(80);
  return all;
}

std::optional<std::pair<Iris, Iris>> find_irises(const FaceMap& map, const cv::Mat& lightness, double scale) {
  const auto lefts = iris_candidates(map, lightness, 1, scale), rights = iris_candidates(map, lightness, -1, scale);
  std::optional<std::pair<Iris, Iris>> best;
  double most = 6;
  for (const Iris& left : lefts)
    for (const Iris& right : rights) {
      const double half = 0.5 * (left.centre.x() - right.centre.x()), gaze = 0.5 * (left.centre.x() + right.centre.x());
      const double cost = squared((half - 0.0315 * scale) / (0.0035 * scale)) + squared(gaze / 0.003) +
                          squared((left.centre.y() - right.centre.y()) / 0.002);
      const double score =
          std::min(left.contrast, right.contrast) + 0.3 * std::max(left.contrast, right.contrast) - 0.5 * cost;
      if (score <= most) continue;
      most = score;
      best = {left, right};
    }
  return best;
}

// 0 where the map looks like the skin of the cheek below, lit or in shadow, up to 1 where it does not: shadow and lines
// on skin keep its saturation, the white of the eye has little, iris, pupil and lashes are far darker than any shadow.
cv::Mat unlike_skin(const FaceMap& map, const cv::Mat& lab, double eye_y) {
  const auto ramp = [](float value, float none, float full) {
    return std::clamp((value - none) / (full - none), 0.0F, 1.0F);
  };
  const auto saturation = [](const cv::Vec3f& colour) {
    return std::hypot(colour[1], colour[2]) / std::max(colour[0], 5.0F);
  };
  cv::Mat unlike(lab.size(), CV_32F, cv::Scalar(0));
  for (const double sign : {-1.0, 1.0}) {
    const Vector2d low(std::min(sign * 0.018, sign * 0.045), eye_y - 0.026),
        high(std::max(sign * 0.018, sign * 0.045), eye_y - 0.012);
    const cv::Vec3f skin = median_colour(map, lab, low, high);
    const float own = std::max(saturation(skin), 0.05F);
    for (int r = 0; r < lab.rows; ++r)
      for (int c = 0; c < lab.cols; ++c) {
        if (sign * map.place(c, r).x() < 0) continue;
        const cv::Vec3f& colour = lab.at<cv::Vec3f>(r, c);
        const float light = colour[0] / std::max(skin[0], 5.0F);
        unlike.at<float>(r, c) =
            std::max({ramp(saturation(colour) / own, 0.8F, 0.45F), ramp(light, 0.55F, 0.3F), ramp(light, 1.2F, 1.45F)});
      }
  }
  return unlike;
}

// The openings' six parameters, those of the right eye mirrored: inner x, y, outer x, y, upper, lower.
using Shape = std::array<double, 6>;

EyeOpening opening_of(const Shape& p, double sign) {
  return {{sign * p[0], p[1]}, {sign * p[2], p[3]}, p[4], p[5]};
}

// Share of cells unlike skin minus a half, summed over the opening, in square millimetres.
double inside_sum(const FaceMap& map, const cv::Mat& unlike, const EyeOpening& eye) {
  double sum = 0;
  const int steps = static_cast<int>(std::abs(eye.outer.x() - eye.inner.x()) / FaceMap::cell);
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / std::max(steps, 1);
    const Vector2d base = eye.inner + t * (eye.outer - eye.inner);
    const double bow = 4 * t * (1 - t);
    const cv::Point2d top = map.pixel(base + Vector2d(0, bow * eye.upper)),
                      bottom = map.pixel(base - Vector2d(0, bow * eye.lower));
    const int c = static_cast<int>(std::lround(top.x));
    if (c < 0 || c >= unlike.cols) return -1e9;
    for (int r = std::max(0, static_cast<int>(std::lround(top.y))); r <= std::min(unlike.rows - 1.0, bottom.y); ++r)
      sum += unlike.at<float>(r, c) - 0.5F;
  }
  return sum * squared(1e3 * FaceMap::cell);
}

// Costs of unusual openings, in the same unit.
double prior_cost(const Shape& p, const Iris& iris, double scale) {
  const double width = (p[2] - p[0]) / scale;
  const double in_opening = ((std::abs(iris.centre.x()) - p[0]) / (p[2] - p[0]) - 0.52) / 0.08;
  return 4 * squared((width - 0.0295) / 0.0025) + 3 * squared((p[4] - 0.0055) / 0.002) +
         3 * squared((p[5] - 0.0040) / 0.0015) + 1.5 * squared((p[3] - p[1] - 0.001) / 0.003) +
         2 * squared(in_opening) + 3 * squared((0.5 * (p[1] + p[3]) - iris.centre.y()) / 0.002);
}

// Pattern search (Hooke and Jeeves, JACM 1961) over the six parameters.
template <class Score>
Shape climb(Shape shape, double step, const Score& score) {
  double best = score(shape);
  while (step > 0.0002) {
    bool better = false;
    for (std::size_t k = 0; k < shape.size(); ++k)
      for (const double sign : {-1.0, 1.0}) {
        Shape trial = shape;
        trial[k] += sign * step;
        if (trial[2] - trial[0] < 0.018 || trial[4] < 0.001 || trial[5] < 0.0005) continue;
        const double value = score(trial);
        if (value <= best) continue;
        best = value;
        shape = trial;
        better = true;
      }
    if (!better) step /= 2;
  }
  return shape;
}

// Mean of the map inside an opening that is grown by `margin` on all sides.
double mean_inside(const FaceMap& map, const cv::Mat& unlike, EyeOpening eye, double margin) {
  const Vector2d way = (eye.outer - eye.inner).normalized();
  eye.outer += margin * way;
  eye.inner -= margin * way;
  eye.upper += margin;
  eye.lower += margin;
  const double area = 2.0 / 3 * (eye.upper + eye.lower) * std::abs(eye.outer.x() - eye.inner.x()) * 1e6;
  return inside_sum(map, unlike, eye) / area + 0.5;
}

}  // namespace

tl::expected<Eyes, std::string> find_eyes(const FaceMap& map, double scale) {
  const cv::Mat lab = lab_of(map, 0.0006);
  cv::Mat lightness;
  cv::extractChannel(lab, lightness, 0);
  const auto irises = find_irises(map, lightness, scale);
  if (!irises) return tl::unexpected(std::string("no open eyes can be told in the pictures"));
  const auto& [left, right] = *irises;
  const Iris mean{{0.5 * (left.centre.x() - right.centre.x()), 0.5 * (left.centre.y() + right.centre.y())}, 0};
  const cv::Mat unlike = unlike_skin(map, lab, mean.centre.y());

  const auto both = [&](const Shape& p) {
    return inside_sum(map, unlike, opening_of(p, 1)) + inside_sum(map, unlike, opening_of(p, -1)) -
           prior_cost(p, mean, scale);
  };
  Shape start = {mean.centre.x() - 0.015 * scale, mean.centre.y(), mean.centre.x() + 0.0145 * scale,
                 mean.centre.y() + 0.001,         0.005,           0.004};
  const Shape shared = climb(start, 0.002, both);
  Eyes eyes;
  for (const double sign : {1.0, -1.0}) {
    const auto own = [&](const Shape& p) {
      double cost = 0;
      for (std::size_t k = 0; k < p.size(); ++k) cost += 6 * squared((p[k] - shared[k]) / 0.0015);
      return inside_sum(map, unlike, opening_of(p, sign)) - cost;
    };
    eyes.eye[sign > 0 ? 0 : 1] = opening_of(climb(shared, 0.0008, own), sign);
  }
  double inside = 0, around = 0;
  for (const EyeOpening& eye : eyes.eye) {
    inside += 0.5 * mean_inside(map, unlike, eye, 0);
    around += 0.5 * mean_inside(map, unlike, eye, 0.003);
  }
  if (inside < 0.5 || around > 0.92 * inside)
    return tl::unexpected(std::string("the corners of the eyes cannot be told from the skin around"));
  eyes.deviation = 0.0018 + 0.6 / std::max(map.resolution, 100.0);
  return eyes;
}

}  // namespace gyre
