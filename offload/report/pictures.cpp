// SPDX-License-Identifier: Apache-2.0
#include "offload/report/pictures.h"

#include "common/render/rasterise.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr double field_of_view = 20.0 * M_PI / 180.0;  // narrow: bodies look odd in wide angles

struct View {
  Camera camera;
  Pose cam_from_world;
};

// A camera around the middle of the box, far enough to see all of it from any azimuth.
View view_of(const Eigen::AlignedBox3d& box, double azimuth, int width, int height) {
  View view;
  view.camera = Camera::from_fov(width, height, field_of_view);
  const double tall = box.sizes().y(), wide = std::hypot(box.sizes().x(), box.sizes().z());
  const double needed = std::max(tall / height, wide / width) * 1.06;  // metres a pixel
  const double distance = needed * view.camera.fx + 0.5 * wide;
  const Eigen::Vector3d middle = box.center();
  view.cam_from_world = look_at(middle + distance * Eigen::Vector3d(std::sin(azimuth), 0, std::cos(azimuth)), middle);
  return view;
}

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? alphabet[group >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

std::string data_uri(const cv::Mat& image, int quality) {
  if (image.empty()) return {};
  std::vector<unsigned char> bytes;
  if (quality > 0) {
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  } else {
    cv::imencode(".png", image, bytes);
  }
  return (quality > 0 ? "data:image/jpeg;base64," : "data:image/png;base64,") +
         base64({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat render_cloud(const PointCloud& cloud, double azimuth, int width, int height) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar::all(255));
  if (cloud.points.empty()) return image;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : cloud.points) box.extend(p.cast<double>());
  // Twice the size, then reduced: discs of odd pixels would show their squares.
  const View view = view_of(box, azimuth, 2 * width, 2 * height);
  cv::Mat large(2 * height, 2 * width, CV_8UC3, cv::Scalar::all(255));
  std::vector<float> depth(large.total(), std::numeric_limits<float>::infinity());
  constexpr int radius = 1;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = view.cam_from_world * cloud.points[i].cast<double>();
    const auto pixel = view.camera.project(p);
    if (!pixel) continue;
    const int cx = static_cast<int>(pixel->x()), cy = static_cast<int>(pixel->y());
    const cv::Vec3b colour = cloud.colours.empty()
                                 ? cv::Vec3b(110, 110, 110)
                                 : cv::Vec3b(cloud.colours[i][2], cloud.colours[i][1], cloud.colours[i][0]);
    for (int y = std::max(0, cy - radius); y <= std::min(large.rows - 1, cy + radius); ++y)
      for (int x = std::max(0, cx - radius); x <= std::min(large.cols - 1, cx + radius); ++x) {
        float& nearest = depth[static_cast<std::size_t>(y) * large.cols + x];
        if (p.z() >= nearest) continue;
        nearest = static_cast<float>(p.z());
        large.at<cv::Vec3b>(y, x) = colour;
      }
  }
  cv::resize(large, image, image.size(), 0, 0, cv::INTER_AREA);
  return image;
}

std::array<cv::Mat, 4> render_turnaround(const TriangleMesh& mesh, const cv::Mat& texture, int width, int height) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  ShadeOptions shade;
  shade.lit = texture.empty();
  shade.background = Eigen::Vector3d::Constant(255);
  std::array<cv::Mat, 4> pictures;
  for (int side = 0; side < 4; ++side) {
    const View view = view_of(box, side * M_PI / 2, 2 * width, 2 * height);
    cv::resize(render(mesh, texture, view.camera, view.cam_from_world, shade), pictures[side], {width, height}, 0, 0,
               cv::INTER_AREA);
  }
  return pictures;
}

}  // namespace gyre
