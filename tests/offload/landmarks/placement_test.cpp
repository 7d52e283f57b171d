// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/placement.h"

#include "common/render/rasterise.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

namespace gyre {
namespace {

// A wall z = 0 with 3 mm between its points, seen from z > 0, and one more wall behind it.
Subject walls(bool with_hole) {
  Subject subject;
  for (int i = -100; i <= 100; ++i)
    for (int j = -100; j <= 100; ++j) {
      const float x = 0.003F * static_cast<float>(i), y = 1 + 0.003F * static_cast<float>(j);
      if (!with_hole || std::hypot(x, y - 1) > 0.05F) {
        subject.cloud.points.emplace_back(x, y, 0);
        subject.cloud.normals.emplace_back(0, 0, 1);
      }
      subject.cloud.points.emplace_back(x, y, -0.2F);
      subject.cloud.normals.emplace_back(0, 0, -1);  // looks away: its front is on the other side
    }
  for (const double x : {-0.6, 0.0, 0.6}) {
    LandmarkView view;
    view.name = "body-" + std::to_string(subject.views.size());
    view.camera = Camera::from_fov(640, 480, 0.9);
    view.cam_from_world = look_at({x, 1.1, 1.5}, {0, 1, 0});
    subject.views.push_back(view);
  }
  return subject;
}

std::vector<PixelDetection> seen(const Subject& subject, const Eigen::Vector3d& place) {
  std::vector<PixelDetection> detections;
  for (int v = 0; v < static_cast<int>(subject.views.size()); ++v)
    detections.push_back({"noseTip", v, *subject.views[v].project(place), 1.0});
  return detections;
}

TEST(Placement, RaysMeetTheCloud) {
  const Subject subject = walls(false);
  const Eigen::Vector3d place(0.02, 1.03, 0);
  for (const std::size_t count : {1U, 3U}) {
    std::vector<PixelDetection> detections = seen(subject, place);
    detections.resize(count);
    const auto mark = place_landmark(subject, detections, "picked");
    ASSERT_TRUE(mark) << mark.error();
    EXPECT_LT((mark->position - place).norm(), 0.001);
    EXPECT_EQ(mark->views.size(), count);
    EXPECT_EQ(mark->source, "picked");
    EXPECT_LT(std::sqrt(mark->covariance.diagonal().maxCoeff()), 0.006);
  }
}

TEST(Placement, MoreViewsAreSurer) {
  const Subject subject = walls(false);
  std::vector<PixelDetection> detections = seen(subject, {0, 1, 0});
  const auto three = place_landmark(subject, detections, "network");
  detections.resize(1);
  const auto one = place_landmark(subject, detections, "network");
  ASSERT_TRUE(one && three);
  EXPECT_LT(three->covariance.trace(), one->covariance.trace());
}

TEST(Placement, AHoleIsNotFilledFromOnePicture) {
  const Subject subject = walls(true);
  std::vector<PixelDetection> detections = seen(subject, {0, 1, 0});
  detections.resize(1);
  EXPECT_FALSE(place_landmark(subject, detections, "network"));
}

TEST(Placement, SeveralPicturesTriangulateInAHole) {
  const Subject subject = walls(true);
  const auto mark = place_landmark(subject, seen(subject, {0, 1, 0.01}), "network");
  ASSERT_TRUE(mark) << mark.error();
  EXPECT_LT((mark->position - Eigen::Vector3d(0, 1, 0.01)).norm(), 0.001);
}

TEST(Placement, AnOutvotedPictureIsLeftOut) {
  const Subject subject = walls(false);
  std::vector<PixelDetection> detections = seen(subject, {0, 1, 0});
  detections[2].pixel.x() += 60;
  const auto mark = place_landmark(subject, detections, "network");
  ASSERT_TRUE(mark);
  EXPECT_EQ(mark->views.size(), 2U);
  EXPECT_LT((mark->position - Eigen::Vector3d(0, 1, 0)).norm(), 0.002);
}

TEST(Placement, PicturesThatDisagreePlaceNothing) {
  const Subject subject = walls(false);
  std::vector<PixelDetection> detections = seen(subject, {0, 1, 0});
  detections.resize(2);
  detections[1].pixel.x() += 60;
  EXPECT_FALSE(place_landmark(subject, detections, "network"));
}

}  // namespace
}  // namespace gyre
