// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/dense_cloud.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <algorithm>

namespace gyre {
namespace {

using test::RayScene;

const Progress quiet = [](double, std::string_view) {};

TEST(DenseCloud, SphereWithoutTheFloor) {
  const RayScene scene;
  DenseCloudOptions options;
  options.voxel = 0.005;
  const auto dense = build_cloud(test::views_on_arc(scene, 6, 9.0, 112), scene.region(), options, quiet);
  ASSERT_TRUE(dense) << dense.error().message();
  EXPECT_EQ(dense->views_used, 6);
  const PointCloud& cloud = dense->cloud;
  EXPECT_GT(cloud.points.size(), 2500U);
  std::vector<double> distances;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    EXPECT_GT(cloud.points[i].y(), 0.0F);
    distances.push_back(std::abs((cloud.points[i].cast<double>() - scene.centre).norm() - scene.radius));
  }
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.002);
  EXPECT_LT(distances[distances.size() * 95 / 100], 0.008);
  EXPECT_NEAR(dense->height, scene.centre.y() + scene.radius, 0.02);
}

// The distance to the true surface is what the stated deviation says: for a normal distribution the median of |error|
// over deviation is 0.67.
TEST(DenseCloud, ErrorsGrowAsTheDeviationsSay) {
  const RayScene scene;
  DenseCloudOptions options;
  options.voxel = 0.003;
  const auto dense = build_cloud(test::views_on_arc(scene, 6, 9.0, 160), scene.region(), options, quiet);
  ASSERT_TRUE(dense) << dense.error().message();
  const PointCloud& cloud = dense->cloud;
  std::vector<std::pair<double, double>> by_deviation;  // and error
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.points[i].y() < 0.03F) continue;  // where the sphere stands on the floor
    const double error = std::abs((cloud.points[i].cast<double>() - scene.centre).norm() - scene.radius);
    by_deviation.emplace_back(cloud.deviation[i], error);
    EXPECT_GE(cloud.views[i], 1);
    EXPECT_LE(cloud.views[i], 6);
  }
  std::sort(by_deviation.begin(), by_deviation.end());
  const auto median_of = [&](std::size_t quarter, const auto& value) {
    const std::size_t begin = by_deviation.size() * quarter / 4;
    const std::size_t end = by_deviation.size() * (quarter + 1) / 4;
    std::vector<double> values;
    for (std::size_t i = begin; i < end; ++i) values.push_back(value(by_deviation[i]));
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  double previous = 0;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    const double ratio = median_of(quarter, [](const auto& p) { return p.second / p.first; });
    EXPECT_GT(ratio, 0.67 / 2) << quarter;
    EXPECT_LT(ratio, 0.67 * 2) << quarter;
    const double error = median_of(quarter, [](const auto& p) { return p.second; });
    EXPECT_GT(error, previous) << quarter;
    previous = error;
  }
}

TEST(DenseCloud, SameForAnyNumberOfThreads) {
  const RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 4, 9.0, 56);
  DenseCloudOptions options;
  options.voxel = 0.005;
  std::vector<PointCloud> clouds;
  for (const int threads : {1, 2, 3}) {
    options.threads = threads;
    auto dense = build_cloud(views, scene.region(), options, quiet);
    ASSERT_TRUE(dense) << dense.error().message();
    clouds.push_back(std::move(dense->cloud));
  }
  for (const PointCloud& other : {clouds[1], clouds[2]}) {
    EXPECT_EQ(other.points, clouds[0].points);
    EXPECT_EQ(other.normals, clouds[0].normals);
    EXPECT_EQ(other.colours, clouds[0].colours);
    EXPECT_EQ(other.confidence, clouds[0].confidence);
    EXPECT_EQ(other.deviation, clouds[0].deviation);
    EXPECT_EQ(other.views, clouds[0].views);
  }
}

TEST(DenseCloud, StaysBelowThePointLimit) {
  const RayScene scene;
  DenseCloudOptions options;
  options.max_points = 1000;
  const auto dense = build_cloud(test::views_on_arc(scene, 4, 9.0, 56), scene.region(), options, quiet);
  ASSERT_TRUE(dense) << dense.error().message();
  EXPECT_LE(dense->cloud.points.size(), 1000U);
}

TEST(DenseCloud, TooFewViewsIsAnError) {
  const RayScene scene;
  const auto dense = build_cloud(test::views_on_arc(scene, 2, 9.0, 32), scene.region(), {}, quiet);
  ASSERT_FALSE(dense);
  EXPECT_NE(dense.error().message().find("at least 3"), std::string::npos);
}

TEST(DenseCloud, AnEmptyBoxIsAnError) {
  const RayScene scene;
  // Air beside the sphere.
  const SubjectRegion air{Eigen::Vector3d(-0.1, 0.75, -0.1), Eigen::Vector3d(0.1, 0.95, 0.1)};
  const auto dense = build_cloud(test::views_on_arc(scene, 4, 9.0, 48), air, {}, quiet);
  ASSERT_FALSE(dense);
  EXPECT_NE(dense.error().message().find("nothing dense"), std::string::npos);
}

TEST(DenseCloud, ViewsWithoutParallaxIsAnError) {
  const RayScene scene;
  const auto dense = build_cloud(test::views_on_arc(scene, 3, 0.1, 32), scene.region(), {}, quiet);
  ASSERT_FALSE(dense);
  EXPECT_NE(dense.error().message().find("usable angles"), std::string::npos);
}

}  // namespace
}  // namespace gyre
