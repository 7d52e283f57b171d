// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/place_views.h"

#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>

namespace gyre {
namespace {

// A chequered ball before cameras all around.
class PlaceViews : public testing::Test {
 protected:
  PlaceViews() {
    scene::add_ball(ball_, 0.25, 16);
    cv::Mat checked = scene::painting(ball_, 1024);
    for (int y = 0; y < 1024; ++y)
      for (int x = 0; x < 1024; ++x) checked.at<cv::Vec3b>(y, x) *= (x / 32 + y / 32) % 2 == 0 ? 1.0 : 0.6;
    photos_ = scene::ring(ball_, checked, 16, 1.6);
    for (const Eigen::Vector3i& t : ball_.triangles)
      normals_.push_back((ball_.vertices[t[0]] + ball_.vertices[t[1]] + ball_.vertices[t[2]]).normalized());
  }

  // Greatest distance by which the projection of a point on the near side is wrong, pixels, root mean square of views.
  double misplaced(const std::vector<Pose>& poses) const {
    double sum = 0;
    for (std::size_t p = 0; p < poses.size(); ++p) {
      const Pose& truth = photos_[p].cam_from_world;
      const Eigen::Vector3d near = 0.25 * centre_of(truth).normalized();
      sum += (*photos_[p].camera.project(poses[p] * near) - *photos_[p].camera.project(truth * near)).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }

  std::vector<Pose> placed(std::span<const Photo> photos) const {
    return place_views(ball_, normals_, std::vector<std::uint8_t>(ball_.triangles.size(), 0), photos, {}, {}, {}, 2);
  }

  TriangleMesh ball_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<Photo> photos_;
};

TEST_F(PlaceViews, FindsHowTheSubjectMoved) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> sway(-0.006, 0.006);
  std::vector<Photo> swayed = photos_;
  std::vector<Pose> before;
  for (Photo& photo : swayed) {
    photo.cam_from_world.translation +=
        photo.cam_from_world.rotation * Eigen::Vector3d(sway(random), sway(random), sway(random));
    before.push_back(photo.cam_from_world);
  }
  EXPECT_GT(misplaced(before), 1.0);
  EXPECT_LT(misplaced(placed(swayed)), 0.35 * misplaced(before));
}

TEST_F(PlaceViews, LeavesWhatStoodStill) {
  EXPECT_LT(misplaced(placed(photos_)), 0.2);
}

TEST_F(PlaceViews, LeavesAPictureThatShowsNothing) {
  Photo blank = photos_[0];
  blank.image = cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(0));
  blank.camera.width = blank.camera.height = 1;
  photos_.push_back(blank);
  const std::vector<Pose> poses = placed(photos_);
  EXPECT_LT((poses.back().translation - blank.cam_from_world.translation).norm(), 0.001);
}

}  // namespace
}  // namespace gyre
