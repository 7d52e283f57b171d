// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/orbit.h"
#include "device/coverage/coverage.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr double degree = M_PI / 180.0;

// A camera at `azimuth` and height over the eye level, 2 m from the axis, that looks at it, tilted down by `tilt`.
Pose cam_from_world(double azimuth, double height, double tilt) {
  const Eigen::Vector3d centre(2 * std::sin(azimuth), height, 2 * std::cos(azimuth));
  const Eigen::Vector3d forward(-std::sin(azimuth) * std::cos(tilt), -std::sin(tilt),
                                -std::cos(azimuth) * std::cos(tilt));
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  return {Eigen::Quaterniond(rotation), -rotation * centre};
}

CameraMotion motion(const Pose& now, const Pose& first) {
  CameraMotion motion;
  motion.cam_from_first = now * first.inverse();
  motion.subject_distance = 2.0;
  motion.is_view = true;
  return motion;
}

TEST(Orbit, ExactMotionGivesExactAzimuthHeightAndElevation) {
  const Pose first = cam_from_world(0.4, 0.0, 10 * degree);
  Orbit orbit;
  OrbitPlace place;
  for (int i = 0; i <= 400; ++i) place = orbit.add(motion(cam_from_world(0.4 + i * degree, 0.0, 10 * degree), first));
  EXPECT_NEAR(place.azimuth, 400 * degree, 0.5 * degree);
  EXPECT_NEAR(place.height, 0.0, 0.01);
  EXPECT_NEAR(place.elevation, 0.0, 0.5 * degree);
  for (int i = 1; i <= 50; ++i) {
    place = orbit.add(motion(cam_from_world(0.4 + 400 * degree, -0.016 * i, (10 + i) * degree), first));
  }
  EXPECT_NEAR(place.azimuth, 400 * degree, 0.5 * degree);
  EXPECT_NEAR(place.height, -0.4, 0.02);
  EXPECT_NEAR(place.elevation, 50 * degree, 0.5 * degree);
}

TEST(Orbit, GoesBackwards) {
  const Pose first = cam_from_world(0.0, 0.0, 0.0);
  Orbit orbit;
  OrbitPlace place;
  for (int i = 0; i <= 300; ++i) place = orbit.add(motion(cam_from_world(-i * degree, 0.0, 0.0), first));
  EXPECT_NEAR(place.azimuth, -300 * degree, 0.5 * degree);
}

TEST(Orbit, ASeenStartTakesOutTheDrift) {
  const double drifting = 0.97;
  const Pose first = cam_from_world(0.0, 0.0, 0.0);
  Orbit orbit;
  Orbit::Mark start;
  for (int i = 0; i <= 360; ++i) {
    orbit.add(motion(cam_from_world(drifting * i * degree, 0.0, 0.0), first));
    if (i == 0) start = orbit.mark();
  }
  EXPECT_NEAR(orbit.drift(start, Eigen::Quaterniond::Identity()), 0.03 * 360 * degree, 0.5 * degree);
  orbit.correct(start, Eigen::Quaterniond::Identity());
  EXPECT_NEAR(orbit.mark().azimuth, 360 * degree, 0.5 * degree);
  OrbitPlace place;
  for (int i = 361; i <= 720; ++i) place = orbit.add(motion(cam_from_world(drifting * i * degree, 0.0, 0.0), first));
  EXPECT_NEAR(place.azimuth, 720 * degree, 1.0 * degree) << "what a turn lacked is added to the next one";
}

TEST(Coverage, TheTurntableSaysTheAzimuth) {
  Coverage coverage("turn", Camera::from_fov(180, 320, 1.0));
  FrameReading frame;
  CoverageReading reading;
  for (int i = 0; i <= 360; ++i) {
    frame.index = i;
    reading = coverage.add(frame, {}, (30 + i) * degree);
    EXPECT_NEAR(reading.place.azimuth, -i * degree, 1e-9);
    EXPECT_EQ(reading.is_closed, i == 360);
  }
  EXPECT_EQ(coverage.map().share(Band::body_upper), 1.0);
}

TEST(Coverage, AFrameWithoutTheTurntablesAngleCoversNothing) {
  Coverage coverage("turn", Camera::from_fov(180, 320, 1.0));
  const cv::Mat luma(320, 180, CV_8U, cv::Scalar(90));
  CoverageReading reading = coverage.add({}, luma);
  EXPECT_FALSE(reading.place.known);
  EXPECT_EQ(coverage.map().cell(Band::body_upper, 0).best_frame, -1);
  coverage.add({}, luma, 0.1);
  coverage.add({}, luma, 0.3);
  reading = coverage.add({}, luma);
  EXPECT_FALSE(reading.place.known);
  EXPECT_NEAR(reading.place.azimuth, -0.2, 1e-12);
}

}  // namespace
}  // namespace gyre
