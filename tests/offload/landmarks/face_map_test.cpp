// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/face_map.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

// Seven views half a metre from a textured plane that lies `depth` before the flat relief they are mapped onto.
struct Scene {
  Subject subject;
  FaceMap map;

  explicit Scene(double depth) {
    Relief& relief = map.relief;
    relief.world_from_relief = Eigen::Translation3d(0.1, 1.5, -0.2) * Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitY());
    relief.low = {-0.08, -0.11};
    relief.columns = 80;
    relief.rows = 100;
    relief.height.assign(8000, 0.0F);
    relief.deviation.assign(8000, 0.0F);
    const int columns = static_cast<int>(std::lround((map.high.x() - map.low.x()) / FaceMap::cell));
    const int rows = static_cast<int>(std::lround((map.high.y() - map.low.y()) / FaceMap::cell));
    for (int i = 0; i < 7; ++i) {
      const double yaw = 0.15 * (i - 3);
      const Eigen::Vector3d centre(0.5 * std::sin(yaw), 0.03 * i, 0.5 * std::cos(yaw));
      LandmarkView view;
      view.cam_from_world.translation = -(relief.world_from_relief * centre);
      subject.views.push_back(view);
      map.views.push_back(i);
      map.weights.push_back(1.0 + 0.1 * i);
      cv::Mat picture(rows, columns, CV_32FC3);
      for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
          const Eigen::Vector2d place = map.place(column, row);
          const Eigen::Vector2d hit = place + depth / centre.z() * (centre.head<2>() - place);
          const auto value = static_cast<float>(120 + 60 * std::sin(900 * hit.x() + 300 * hit.y()) +
                                                40 * std::sin(1100 * hit.y()) * std::cos(500 * hit.x()));
          picture.at<cv::Vec3f>(row, column) = cv::Vec3f(value, value, value);
        }
      map.pictures.push_back(picture);
    }
  }

  Eigen::Vector3d in_relief(const Eigen::Vector3d& world) const {
    return map.relief.world_from_relief.inverse() * world;
  }
};

TEST(SweepDepth, FindsAPlaneBeforeAndBehindTheRelief) {
  for (const double depth : {-0.003, 0.0, 0.0022, 0.004}) {
    const Scene scene(depth);
    for (const Eigen::Vector2d& place : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.025, -0.03)}) {
      const auto swept = sweep_depth(scene.subject, scene.map, place);
      ASSERT_TRUE(swept) << depth;
      const Eigen::Vector3d found = scene.in_relief(*swept);
      EXPECT_NEAR(found.z(), depth, 3e-4);
      EXPECT_LT((found.head<2>() - place).norm(), std::abs(depth) + 1e-4);
    }
  }
}

TEST(SweepDepth, SaysNothingWhereNothingIsSeen) {
  Scene scene(0.002);
  for (cv::Mat& picture : scene.map.pictures) picture.setTo(cv::Scalar(90, 90, 90));
  EXPECT_FALSE(sweep_depth(scene.subject, scene.map, {0.0, 0.0}));
}

TEST(SweepDepth, NeedsThreeViews) {
  Scene scene(0.002);
  scene.map.views.resize(2);
  scene.map.pictures.resize(2);
  EXPECT_FALSE(sweep_depth(scene.subject, scene.map, {0.0, 0.0}));
}

}  // namespace
}  // namespace gyre
