// SPDX-License-Identifier: Apache-2.0
#include "device/calibration/calibrate_camera.h"

#include "tests/device/calibration/lens_picture.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

// A usual lens of a small camera.
const Camera lens{.width = 800,
                  .height = 600,
                  .fx = 690,
                  .fy = 690,
                  .cx = 407.3,
                  .cy = 293.8,
                  .k1 = -0.12,
                  .k2 = 0.05,
                  .p1 = 0.001,
                  .p2 = -0.0008};

BoardView exact_view(const Camera& camera, const Pose& pose) {
  BoardView view;
  for (const Eigen::Vector2d& pixel : true_corners(camera, pose))
    view.push_back({static_cast<int>(view.size()), pixel});
  return view;
}

std::vector<BoardView> exact_views(const Camera& camera, int count, double tilt) {
  std::vector<BoardView> views;
  for (const Pose& pose : round_of_views(camera, count, tilt)) views.push_back(exact_view(camera, pose));
  return views;
}

// Largest distance, over the picture, between where two lenses see the same direction: pixels.
double largest_difference(const Camera& a, const Camera& b) {
  double largest = 0.0;
  for (double y = 0; y <= a.height; y += a.height / 8.0) {
    for (double x = 0; x <= a.width; x += a.width / 8.0) {
      const Eigen::Vector2d pixel(x, y);
      largest = std::max(largest, (b.pixel_from_normalised(a.normalised_from_pixel(pixel)) - pixel).norm());
    }
  }
  return largest;
}

TEST(CalibrateCamera, FindsTheLensExactlyFromExactCorners) {
  const Result<Calibration> found = calibrate_camera(exact_views(lens, 16, 45 * degree), lens.width, lens.height);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(found->error, 1e-3);
  EXPECT_NEAR(found->camera.fx, lens.fx, 0.02);
  EXPECT_NEAR(found->camera.cx, lens.cx, 0.02);
  EXPECT_NEAR(found->camera.cy, lens.cy, 0.02);
  EXPECT_LT(largest_difference(lens, found->camera), 0.05);
  EXPECT_EQ(found->views, 16);
  EXPECT_EQ(found->camera.width, lens.width);
}

TEST(CalibrateCamera, FindsTheLensOfRenderedPictures) {
  std::vector<BoardView> views;
  for (const Pose& pose : round_of_views(lens, 16, 45 * degree))
    views.push_back(find_board(picture_through_lens(lens, pose)));
  const Result<Calibration> found = calibrate_camera(views, lens.width, lens.height);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_LT(found->error, 0.3);
  EXPECT_GE(found->views, 14);
  EXPECT_NEAR(found->camera.fx / lens.fx, 1.0, 0.006);
  EXPECT_EQ(found->camera.fx, found->camera.fy);
  EXPECT_NEAR(found->camera.cx, lens.cx, 4.0);
  EXPECT_NEAR(found->camera.cy, lens.cy, 4.0);
  // It is as sure of the focal length as it says.
  EXPECT_LT(std::abs(found->camera.fx / lens.fx - 1.0), 4.0 * found->focal_deviation);
  RecordProperty("focal_error_percent", std::to_string(100.0 * (found->camera.fx / lens.fx - 1.0)));
  RecordProperty("error_px", std::to_string(found->error));
}

TEST(CalibrateCamera, LeavesOutAViewOfABoardThatMoved) {
  std::vector<BoardView> views = exact_views(lens, 16, 45 * degree);
  for (std::size_t i = 0; i < views[5].size(); ++i) views[5][i].pixel.x() += i % 2 == 0 ? 4.0 : -4.0;
  const Result<Calibration> found = calibrate_camera(views, lens.width, lens.height);
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->views, 15);
  EXPECT_NEAR(found->camera.fx, lens.fx, 0.05);
}

void expect_refused(const Result<Calibration>& found, const std::string& what, const std::string& remedy) {
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message().find(what), std::string::npos) << found.error().message();
  EXPECT_NE(found.error().remedy.find(remedy), std::string::npos) << found.error().message();
}

TEST(CalibrateCamera, RefusesTooFewViews) {
  std::vector<BoardView> views = exact_views(lens, 11, 45 * degree);
  views.resize(30);  // without a board
  expect_refused(calibrate_camera(views, lens.width, lens.height), "11 of at least 12", "take more");
}

TEST(CalibrateCamera, RefusesABoardThatCoversTooLittle) {
  std::vector<BoardView> views;
  for (const BoardView& view : exact_views(lens, 48, 45 * degree)) {
    if (view.front().pixel.x() < 400 && view.back().pixel.x() < 400) views.push_back(view);
  }
  ASSERT_GE(views.size(), 12u);
  const Result<Calibration> found = calibrate_camera(views, lens.width, lens.height);
  expect_refused(found, "upper right", "hold it there");
  EXPECT_EQ(found.error().message().find("left"), std::string::npos);
}

TEST(CalibrateCamera, RefusesCornersThatFitNoLens) {
  std::vector<BoardView> views = exact_views(lens, 20, 45 * degree);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 2.0);
  for (BoardView& view : views) {
    for (BoardCorner& corner : view) corner.pixel += Eigen::Vector2d(noise(random), noise(random));
  }
  expect_refused(calibrate_camera(views, lens.width, lens.height), "pixels off", "flat");
}

TEST(CalibrateCamera, RefusesViewsThatDoNotTellTheFocalLength) {
  std::vector<BoardView> views = exact_views(lens, 20, 3 * degree);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.15);
  for (BoardView& view : views) {
    for (BoardCorner& corner : view) corner.pixel += Eigen::Vector2d(noise(random), noise(random));
  }
  expect_refused(calibrate_camera(views, lens.width, lens.height), "focal length", "tilt");
}

TEST(CalibrationOptions, AreChecked) {
  EXPECT_TRUE(CalibrationOptions().check());
  EXPECT_FALSE(CalibrationOptions{.least_views = 2}.check());
  EXPECT_FALSE(CalibrationOptions{.largest_error = 0.0}.check());
  EXPECT_FALSE(CalibrationOptions{.least_covered = 1.2}.check());
}

}  // namespace
}  // namespace gyre
