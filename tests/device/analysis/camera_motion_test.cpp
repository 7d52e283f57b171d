// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/camera_motion.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

constexpr double degree = M_PI / 180.0;

// A textured figure before a textured wall, both facing the first camera, seen by a camera that goes around the figure.
class Stage {
 public:
  Stage() {
    // Both with detail of about two pixels as the camera sees them, so that neither draws all points.
    make_texture(wall_, {900, 900}, 4.0);
    make_texture(figure_, {180, 576}, 5.0);
  }

  const Camera& camera() const { return camera_; }

  // The camera after a turn about the figure.
  static Pose cam_from_first(double turned) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitY()));
    return {turn, Eigen::Vector3d(0, 0, 2) - turn * Eigen::Vector3d(0, 0, 2)};
  }
  // The figure leans by an angle about its soles, to the side, and has stepped aside.
  cv::Mat see(const Pose& pose, double lean, double aside = 0.0) const {
    cv::Mat picture(320, 180, CV_8U, cv::Scalar(0));
    paint(picture, wall_, pose, {0, 0, 4.0}, 6.0, 6.0, 0.0);
    paint(picture, figure_, pose, {aside, 0, 2.0}, 0.5, 1.6, lean);
    return picture;
  }

 private:
  static void make_texture(cv::Mat& texture, const cv::Size& size, double sigma) {
    cv::RNG random(9);
    texture.create(size, CV_8U);
    random.fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, {}, sigma);
    cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  }
  void paint(cv::Mat& picture, const cv::Mat& texture, const Pose& pose, const Eigen::Vector3d& middle, double width,
             double height, double lean) const {
    std::vector<cv::Point2f> from, to;
    for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
      from.emplace_back(static_cast<float>((x + 0.5) * texture.cols), static_cast<float>((y + 0.5) * texture.rows));
      const Eigen::Vector3d soles = middle + Eigen::Vector3d(0, 0.5 * height, 0);
      const Eigen::Vector3d upright(x * width, (y - 0.5) * height, 0);
      const auto pixel = camera_.project(pose * (soles + Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitZ()) * upright));
      to.emplace_back(static_cast<float>(pixel->x() - 0.5), static_cast<float>(pixel->y() - 0.5));
    }
    cv::warpPerspective(texture, picture, cv::getPerspectiveTransform(from, to), picture.size(), cv::INTER_LINEAR,
                        cv::BORDER_TRANSPARENT);
  }

  Camera camera_ = Camera::from_fov(180, 320, 58 * degree);
  cv::Mat wall_, figure_;
};

TEST(CameraMotion, FollowsAWalkAroundTheFigure) {
  const Stage stage;
  CameraMotionEstimator estimator(stage.camera());
  CameraMotion motion;
  for (int i = 0; i <= 30; ++i) {
    motion = estimator.add(stage.see(Stage::cam_from_first(i * degree), 0.0), i / 15.0);
    EXPECT_TRUE(motion.known);
    EXPECT_LT(motion.subject_motion, 1.0) << "the figure stands still";
  }
  EXPECT_LT(angle_between(motion.cam_from_first.rotation, Stage::cam_from_first(30 * degree).rotation), 2.5 * degree);
}

TEST(CameraMotion, SeesThatTheFigureLeans) {
  const Stage stage;
  CameraMotionEstimator estimator(stage.camera());
  double still = 0.0, leaning = 0.0;
  for (int i = 0; i <= 55; ++i) {
    const double lean = i < 25 ? 0.0 : 2.5 * degree * std::sin(2 * M_PI * (i - 25) / 15.0);  // once a second
    const CameraMotion motion = estimator.add(stage.see(Stage::cam_from_first(0.6 * i * degree), lean), i / 15.0);
    double& largest = i < 25 ? still : leaning;
    largest = std::max(largest, motion.subject_motion);
  }
  EXPECT_LT(still, 0.5);
  EXPECT_GT(leaning, 1.5);
}

TEST(CameraMotion, TellsAStepAsideAndItsEnd) {
  const Stage stage;
  CameraMotionEstimator estimator(stage.camera());
  constexpr int begin = 20, end = 30, frames = 50;
  for (int i = 0; i < frames; ++i) {
    const double aside = 0.25 * std::clamp((i - begin) / static_cast<double>(end - begin), 0.0, 1.0);
    const CameraMotion motion = estimator.add(stage.see(Stage::cam_from_first(0.6 * i * degree), 0.0, aside), i / 15.0);
    EXPECT_TRUE(motion.known) << i;
    if (i > begin + 4 && i <= end) {
      EXPECT_GT(motion.subject_motion, 2.0) << i << ": the figure moves";
    }
    if (i < begin || i > end + 5) {
      EXPECT_LT(motion.subject_motion, 1.6) << i << ": the figure stands still";
    }
  }
}

TEST(CameraMotion, AStandingCameraStands) {
  const Stage stage;
  CameraMotionEstimator estimator(stage.camera());
  for (int i = 0; i <= 20; ++i) {
    const CameraMotion motion = estimator.add(stage.see(Stage::cam_from_first(0.0), 0.0), i / 15.0);
    EXPECT_LT(angle_between(motion.cam_from_first.rotation, Eigen::Quaterniond::Identity()), 0.05 * degree);
  }
}

TEST(CameraMotion, SaysWhenThePictureTellsNothing) {
  const Stage stage;
  CameraMotionEstimator estimator(stage.camera());
  for (int i = 0; i <= 10; ++i) estimator.add(stage.see(Stage::cam_from_first(i * degree), 0.0), i / 15.0);
  const CameraMotion dark = estimator.add(cv::Mat(320, 180, CV_8U, cv::Scalar(0)), 11 / 15.0);
  EXPECT_FALSE(dark.known);
  EXPECT_GT(angle_between(dark.cam_from_first.rotation, Stage::cam_from_first(10 * degree).rotation), 0.3 * degree)
      << "the walk is assumed to go on";
}

}  // namespace
}  // namespace gyre
