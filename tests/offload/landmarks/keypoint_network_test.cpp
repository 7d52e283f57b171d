// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/keypoint_network.h"

#include "offload/landmarks/network_detector.h"
#include "offload/landmarks/subject.h"
#include "tests/offload/landmarks/onnx_writer.h"
#include "tests/offload/landmarks/people.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

constexpr int keypoints = 133;

KeypointNetworkOptions options_of(int width, int height) {
  KeypointNetworkOptions options;
  options.width = width;
  options.height = height;
  return options;
}

// A box whose crop is the picture itself: width x height of the input, grown by a quarter.
cv::Rect2d whole(double width, double height) {
  return {0.1 * width, 0.1 * height, 0.8 * width, 0.8 * height};
}

TEST(KeypointNetwork, ReadsPeaksOfHeatMaps) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "heat.onnx";
  constexpr int rows = 16, columns = 12, stride = 4;
  std::vector<float> heat(keypoints * rows * columns, 0.0F);
  for (int k = 0; k < keypoints; ++k) heat[(k * rows + k % rows) * columns + k % columns] = 0.5F + 0.001F * k;
  write_constant_network(file, columns * stride, rows * stride, {{"heat", {1, keypoints, rows, columns}, heat}});
  const auto network = KeypointNetwork::load(file, options_of(columns * stride, rows * stride));
  ASSERT_TRUE(network) << network.error().message();
  const cv::Mat picture(rows * stride, columns * stride, CV_8UC3, cv::Scalar(30, 60, 90));
  const auto found = network->keypoints(picture, whole(columns * stride, rows * stride));
  ASSERT_TRUE(found) << found.error().message();
  ASSERT_EQ(found->size(), static_cast<std::size_t>(keypoints));
  for (int k = 0; k < keypoints; ++k) {
    EXPECT_NEAR((*found)[k].pixel.x(), stride * (k % columns) + 0.5, 1e-9) << k;
    EXPECT_NEAR((*found)[k].pixel.y(), stride * (k % rows) + 0.5, 1e-9) << k;
    EXPECT_NEAR((*found)[k].confidence, 0.5 + 0.001 * k, 1e-5) << k;
  }
  // A larger picture with the person in its corner: the same places, moved and scaled.
  const cv::Mat large(400, 300, CV_8UC3, cv::Scalar(30, 60, 90));
  const auto scaled = network->keypoints(large, {100 + 9.6, 200 + 12.8, 2 * 38.4, 2 * 51.2});
  ASSERT_TRUE(scaled);
  EXPECT_NEAR((*scaled)[5].pixel.x(), 100 + 2 * (stride * 5 + 0.5), 0.01);
  EXPECT_NEAR((*scaled)[5].pixel.y(), 200 + 2 * (stride * 5 + 0.5), 0.01);
}

TEST(KeypointNetwork, ReadsPeaksOfSimCc) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "simcc.onnx";
  constexpr int width = 24, height = 32, split = 2;
  std::vector<float> x(keypoints * width * split, 0.0F), y(keypoints * height * split, 0.0F);
  for (int k = 0; k < keypoints; ++k) {
    x[k * width * split + k % (width * split)] = 0.9F;
    y[k * height * split + k % (height * split)] = 0.7F;
  }
  write_constant_network(file, width, height,
                         {{"x", {1, keypoints, width * split}, x}, {"y", {1, keypoints, height * split}, y}});
  const auto network = KeypointNetwork::load(file, options_of(width, height));
  ASSERT_TRUE(network) << network.error().message();
  const cv::Mat picture(height, width, CV_8UC3, cv::Scalar(30, 60, 90));
  const auto found = network->keypoints(picture, whole(width, height));
  ASSERT_TRUE(found) << found.error().message();
  for (int k = 0; k < keypoints; ++k) {
    EXPECT_NEAR((*found)[k].pixel.x(), 0.5 * (k % (width * split)) + 0.5, 1e-9) << k;
    EXPECT_NEAR((*found)[k].pixel.y(), 0.5 * (k % (height * split)) + 0.5, 1e-9) << k;
    EXPECT_NEAR((*found)[k].confidence, 0.7, 1e-5);
  }
}

TEST(KeypointNetwork, FaultsAreErrors) {
  const TemporaryFolder folder;
  EXPECT_FALSE(KeypointNetwork::load(folder.path() / "absent.onnx", {}));
  std::ofstream(folder.path() / "junk.onnx") << "this is no network";
  EXPECT_FALSE(KeypointNetwork::load(folder.path() / "junk.onnx", {}));
  KeypointNetworkOptions bad;
  bad.deviation = {1, 0, 1};
  EXPECT_FALSE(KeypointNetwork::load(folder.path() / "junk.onnx", bad));
  // A network of 17 keypoints under the layout of 133.
  write_constant_network(folder.path() / "small.onnx", 16, 16,
                         {{"heat", {1, 17, 4, 4}, std::vector<float>(17 * 16, 0.0F)}});
  const auto network = KeypointNetwork::load(folder.path() / "small.onnx", options_of(16, 16));
  ASSERT_TRUE(network);
  const auto found = network->keypoints(cv::Mat(16, 16, CV_8UC3, cv::Scalar()), whole(16, 16));
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().message().find("133"), std::string::npos);
}

// Pictures in which the heels are coloured dots, and a network that finds these colours.
TEST(NetworkDetector, PlacesWhatTheNetworkSeesOnTheCloud) {
  const TemporaryFolder folder;
  const Person person = synthetic_person({.points = 30000});
  const Eigen::Vector3d left_heel(0.127, 0.03, -0.087), right_heel(-0.127, 0.03, -0.087);
  std::vector<LandmarkView> views = views_around(1.7, 8);
  for (LandmarkView& view : views) {
    cv::Mat picture(view.camera.height, view.camera.width, CV_8UC3, cv::Scalar(0, 0, 0));
    const auto dot = [&](const Eigen::Vector3d& place, const cv::Scalar& colour) {
      const Eigen::Vector2d pixel = *view.project(place);
      cv::circle(picture, cv::Point2d(pixel.x() - 0.5, pixel.y() - 0.5), 4, colour, -1);
    };
    dot(left_heel, {0, 0, 255});   // red
    dot(right_heel, {255, 0, 0});  // blue
    view.picture = folder.path() / (view.name + ".png");
    cv::imwrite(view.picture.string(), picture);
  }
  KeypointNetworkOptions options = options_of(192, 256);
  options.mean = {0, 0, 0};
  options.deviation = {255, 255, 255};
  std::vector<ColourFilter> filters(keypoints, {{0, 0, 0}, -1});
  for (const int body : {5, 6, 7, 8, 9, 10}) filters[body] = {{0, 0, 0}, 0.9F};  // seen, somewhere
  filters[19] = {{1, -1, -1}, 0};
  filters[22] = {{-1, -1, 1}, 0};
  write_colour_network(folder.path() / "colours.onnx", 192, 256, filters);
  auto network = KeypointNetwork::load(folder.path() / "colours.onnx", options);
  ASSERT_TRUE(network) << network.error().message();
  const auto subject = make_subject(person.cloud, views);
  ASSERT_TRUE(subject);
  NetworkDetector detector(std::move(*network));
  const auto found = detector.detect(*subject, [](double, std::string_view) {});
  ASSERT_TRUE(found) << found.error().message();
  ASSERT_FALSE(found->pixels.empty());
  for (const PixelDetection& detection : found->pixels) {
    const Eigen::Vector3d& truth = detection.name == "leftHeel" ? left_heel : right_heel;
    EXPECT_LT((detection.pixel - *views[detection.view].project(truth)).norm(), 5) << detection.name;
    EXPECT_LT(views[detection.view].centre().z(), 0) << "heels are looked for from behind";
  }
  EXPECT_TRUE(found->missing.contains("noseTip"));
}

}  // namespace
}  // namespace gyre
