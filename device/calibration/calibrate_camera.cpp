// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/calibrate_camera.h"

#include "common/board/board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>

namespace gyre {

namespace {

constexpr int parts = 4;                                   // a side
using Parts = std::array<std::array<bool, parts>, parts>;  // [row][column]

struct Correspondences {
  std::vector<std::vector<cv::Point3f>> on_board;
  std::vector<std::vector<cv::Point2f>> in_picture;
};

struct Solution {
  Camera camera;
  double error = 0.0;
  std::vector<double> errors;  // by view
};

Parts seen_parts(std::span<const BoardView> views, int width, int height) {
  Parts seen{};
  const auto part = [](double at, int size) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(parts * at / size), 0, parts - 1));
  };
  for (const BoardView& view : views) {
    for (const BoardCorner& corner : view) seen[part(corner.pixel.y(), height)][part(corner.pixel.x(), width)] = true;
  }
  return seen;
}

Correspondences correspondences_of(std::span<const BoardView> views) {
  Correspondences all;
  for (const BoardView& view : views) {
    std::vector<cv::Point3f> on_board;
    std::vector<cv::Point2f> in_picture;
    for (const BoardCorner& corner : view) {
      const Eigen::Vector2f place = board_corner(corner.corner).cast<float>();
      on_board.emplace_back(place.x(), place.y(), 0.0F);
      // OpenCV counts from the centre of the first pixel.
      in_picture.emplace_back(static_cast<float>(corner.pixel.x() - 0.5), static_cast<float>(corner.pixel.y() - 0.5));
    }
    all.on_board.push_back(std::move(on_board));
    all.in_picture.push_back(std::move(in_picture));
  }
  return all;
}

Result<Solution> solve(std::span<const BoardView> views, int width, int height) {
  const Correspondences all = correspondences_of(views);
  cv::Mat lens = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat distortion, errors;
  std::vector<cv::Mat> rotations, translations;
  Solution solution;
  try {
    solution.error =
        cv::calibrateCamera(all.on_board, all.in_picture, {width, height}, lens, distortion, rotations, translations,
                            cv::noArray(), cv::noArray(), errors, cv::CALIB_FIX_ASPECT_RATIO | cv::CALIB_FIX_K3);
  } catch (const cv::Exception&) {
    return fail("the views of the board do not make a lens", "", "take other pictures, from more directions");
  }
  const auto coefficient = [&](int i) { return distortion.at<double>(i); };
  solution.camera = {.width = width,
                     .height = height,
                     .fx = lens.at<double>(0, 0),
                     .fy = lens.at<double>(1, 1),
                     .cx = lens.at<double>(0, 2) + 0.5,
                     .cy = lens.at<double>(1, 2) + 0.5,
                     .k1 = coefficient(0),
                     .k2 = coefficient(1),
                     .p1 = coefficient(2),
                     .p2 = coefficient(3)};
  solution.errors.assign(errors.begin<double>(), errors.end<double>());
  return solution;
}

// Standard deviation of the focal length, of that length, by the jackknife (Efron 1982): how much it changes when one
// of five parts of the views is left out.
Result<double> focal_deviation(std::span<const BoardView> views, int width, int height) {
  constexpr std::size_t groups = 5;
  std::array<double, groups> focal{};
  double mean = 0.0;
  for (std::size_t group = 0; group < groups; ++group) {
    std::vector<BoardView> rest;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (i % groups != group) rest.push_back(views[i]);
    }
    const Result<Solution> solution = solve(rest, width, height);
    if (!solution) return tl::unexpected(solution.error());
    focal[group] = solution->camera.fy;
    mean += focal[group] / groups;
  }
  double sum = 0.0;
  for (const double f : focal) sum += (f - mean) * (f - mean);
  return std::sqrt(sum * (groups - 1) / groups) / mean;
}

// Without the views that fit three times worse than the middle one, as of a board that moved.
std::vector<BoardView> good_ones(std::span<const BoardView> views, const std::vector<double>& errors) {
  std::vector<double> sorted = errors;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double limit = 3.0 * sorted[sorted.size() / 2];
  std::vector<BoardView> good;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (errors[i] <= limit) good.push_back(views[i]);
  }
  return good;
}

std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string rounded(double value, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

Result<void> judge(const Calibration& found, std::span<const BoardView> views, const CalibrationOptions& options) {
  const Camera& camera = found.camera;
  if (found.covered < options.least_covered) {
    return fail("the board was seen in too little of the picture",
                "missing " + listed(not_covered(views, camera.width, camera.height)),
                "hold it there too, close enough to fill a third of the picture");
  }
  const double limit = options.largest_error * std::max(camera.width, camera.height);
  if (!(found.error <= limit)) {
    return fail("the board's corners do not fit a lens",
                rounded(found.error, 2) + " pixels off, at most " + rounded(limit, 2) + " are good",
                "lay it on something flat, hold still, and give more light");
  }
  if (!(found.focal_deviation <= options.largest_focal_deviation)) {
    return fail("the focal length is not sure", "to " + rounded(100.0 * found.focal_deviation, 1) + " %",
                "tilt the board against the camera, by 30 to 50 degrees to all sides");
  }
  return {};
}

}  // namespace

Result<void> CalibrationOptions::check() const {
  if (least_views < 3) return wrong_use("a lens takes three views at the least", std::to_string(least_views));
  if (!(largest_error > 0.0 && largest_focal_deviation > 0.0)) return wrong_use("limits of a calibration are positive");
  if (!(least_covered >= 0.0 && least_covered <= 1.0)) return wrong_use("a share is 0 to 1");
  return {};
}

double covered(std::span<const BoardView> views, int width, int height) {
  int count = 0;
  for (const auto& row : seen_parts(views, width, height)) count += static_cast<int>(std::ranges::count(row, true));
  return static_cast<double>(count) / (parts * parts);
}

std::vector<std::string> not_covered(std::span<const BoardView> views, int width, int height) {
  const Parts seen = seen_parts(views, width, height);
  constexpr std::array<const char*, 3> rows = {"upper", "middle", "lower"};
  constexpr std::array<const char*, 3> columns = {"left", "middle", "right"};
  std::array<std::array<bool, 3>, 3> missing{};
  // The middle two of four are one region.
  const auto region = [](std::size_t part) { return part == 0 ? 0U : part == parts - 1 ? 2U : 1U; };
  for (std::size_t y = 0; y < parts; ++y) {
    for (std::size_t x = 0; x < parts; ++x) {
      if (!seen[y][x]) missing[region(y)][region(x)] = true;
    }
  }
  std::vector<std::string> words;
  for (std::size_t y = 0; y < 3; ++y) {
    for (std::size_t x = 0; x < 3; ++x) {
      const std::string word = y == 1 && x == 1 ? "middle" : std::string(rows[y]) + " " + columns[x];
      if (missing[y][x]) words.push_back(word);
    }
  }
  return words;
}

Result<Calibration> calibrate_camera(std::span<const BoardView> views, int width, int height,
                                     const CalibrationOptions& options) {
  std::vector<BoardView> used;
  std::ranges::copy_if(views, std::back_inserter(used), [](const BoardView& v) { return v.size() >= least_corners; });
  const auto enough = [&]() -> Result<void> {
    if (static_cast<int>(used.size()) >= options.least_views) return {};
    return fail("too few pictures show the board",
                std::to_string(used.size()) + " of at least " + std::to_string(options.least_views),
                "take more, each from another side and with the whole board in it");
  };
  if (const Result<void> first = enough(); !first) return tl::unexpected(first.error());
  Result<Solution> solution = solve(used, width, height);
  if (!solution) return tl::unexpected(solution.error());
  if (std::vector<BoardView> good = good_ones(used, solution->errors); good.size() < used.size()) {
    used = std::move(good);
    if (const Result<void> left = enough(); !left) return tl::unexpected(left.error());
    solution = solve(used, width, height);
    if (!solution) return tl::unexpected(solution.error());
  }
  const Result<double> deviation = focal_deviation(used, width, height);
  if (!deviation) return tl::unexpected(deviation.error());
  const Calibration found = {solution->camera, static_cast<int>(used.size()), solution->error,
                             covered(used, width, height), *deviation};
  if (const Result<void> good = judge(found, used, options); !good) return tl::unexpected(good.error());
  return found;
}

}  // namespace gyre
