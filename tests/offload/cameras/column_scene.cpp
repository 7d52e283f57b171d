// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/cameras/column_scene.h"

#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

namespace gyre {

namespace {

constexpr double column_radius = 0.3, wall_radius = 6.0, ring_radius = 2.0;  // metres
constexpr double pi = std::numbers::pi;

Pose pose_at(double angle) {
  const Eigen::Vector3d centre(ring_radius * std::sin(angle), 1.2, ring_radius * std::cos(angle));
  const Eigen::Vector3d z = (Eigen::Vector3d(0, 1, 0) - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {Eigen::Quaterniond(rotation).normalized(), -(rotation * centre)};
}

double angle_of(const Pose& pose) {
  const Eigen::Vector3d centre = centre_of(pose);
  return std::atan2(centre.x(), centre.z());
}

// Smooth noise with period 2 pi in u; both coordinates in radians.
const cv::Mat& pattern() {
  static const cv::Mat made = [] {
    cv::Mat noise(512, 1024, CV_32F), wide, smooth;
    cv::RNG(4).fill(noise, cv::RNG::UNIFORM, 0.0, 255.0);
    cv::copyMakeBorder(noise, wide, 16, 16, 16, 16, cv::BORDER_WRAP);
    cv::GaussianBlur(wide, wide, {}, 3.0);
    smooth = wide(cv::Rect(16, 16, 1024, 512)).clone();
    cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
    return smooth;
  }();
  return made;
}

float pattern_at(double u, double v) {
  const cv::Mat& image = pattern();
  const auto wrap = [](double x, int size) { return x - size * std::floor(x / size); };
  const double x = wrap(u / (2 * pi) * image.cols, image.cols), y = wrap(v / (2 * pi) * image.cols, image.rows);
  const int x0 = static_cast<int>(x) % image.cols, y0 = static_cast<int>(y) % image.rows;
  const int x1 = (x0 + 1) % image.cols, y1 = (y0 + 1) % image.rows;
  const auto fx = static_cast<float>(x - std::floor(x)), fy = static_cast<float>(y - std::floor(y));
  return (1 - fy) * ((1 - fx) * image.at<float>(y0, x0) + fx * image.at<float>(y0, x1)) +
         fy * ((1 - fx) * image.at<float>(y1, x0) + fx * image.at<float>(y1, x1));
}

// Distance along the ray to the upright cylinder around the origin: its near side, or its far side from inside.
std::optional<double> hit(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double radius) {
  const double a = ray.x() * ray.x() + ray.z() * ray.z();
  const double b = from.x() * ray.x() + from.z() * ray.z();
  const double c = from.x() * from.x() + from.z() * from.z() - radius * radius;
  const double d = b * b - a * c;
  if (d < 0) return std::nullopt;
  return ((c > 0 ? -b - std::sqrt(d) : -b + std::sqrt(d))) / a;
}

// The pattern where the ray meets a surface; nothing where it does not.
std::optional<float> shade(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, double radius) {
  const auto distance = hit(from, ray, radius);
  if (!distance || *distance <= 0) return std::nullopt;
  const Eigen::Vector3d p = from + *distance * ray;
  return pattern_at(std::atan2(p.x(), p.z()), p.y() / radius + radius);
}

float shade(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  const auto column = shade(from, ray, column_radius);
  return column ? *column : shade(from, ray, wall_radius).value_or(0.0F);
}

}  // namespace

cv::Mat Column::picture(int view, double sweep) const {
  const Camera& camera = scene.cameras[0];
  const double middle = angle_of(scene.views[view].cam_from_world);
  const int moments = sweep == 0.0 ? 1 : 15;
  cv::Mat sum(camera.height, camera.width, CV_32F, cv::Scalar(0)), picture;
  for (int m = 0; m < moments; ++m) {
    const Pose pose = pose_at(middle + (moments == 1 ? 0.0 : sweep * (static_cast<double>(m) / (moments - 1) - 0.5)));
    const Eigen::Vector3d from = centre_of(pose);
    const Eigen::Quaterniond world_from_cam = pose.rotation.conjugate();
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        sum.at<float>(y, x) +=
            shade(from, world_from_cam * camera.normalised_from_pixel({x + 0.5, y + 0.5}).homogeneous());
  }
  sum.convertTo(picture, CV_8U, 1.0 / moments);
  return picture;
}

cv::Mat Column::turned_picture(int view) const {
  const Camera& camera = scene.cameras[0];
  const Pose& for_column = scene.views[view].cam_from_world;
  const Pose& for_room = scene.views[0].cam_from_world;
  cv::Mat picture(camera.height, camera.width, CV_8U);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = camera.normalised_from_pixel({x + 0.5, y + 0.5}).homogeneous();
      auto light = shade(centre_of(for_column), for_column.rotation.conjugate() * ray, column_radius);
      if (!light) light = shade(centre_of(for_room), for_room.rotation.conjugate() * ray, wall_radius);
      picture.at<unsigned char>(y, x) = cv::saturate_cast<unsigned char>(light.value_or(0.0F));
    }
  }
  return picture;
}

Column make_column(int views) {
  Column column;
  Scene& scene = column.scene;
  scene.cameras.push_back({.width = 240, .height = 400, .fx = 350, .fy = 350, .cx = 120, .cy = 200});
  for (int v = 0; v < views; ++v) {
    View view;
    view.order = v;
    view.registered = true;
    view.cam_from_world = pose_at(2 * pi * v / views);
    scene.views.push_back(view);
  }
  std::mt19937 random(8);
  std::uniform_real_distribution<double> turn(-pi, pi), height(0, 2), share(0, 1);
  for (int i = 0; i < 3000; ++i) {
    const double radius = i % 3 == 0 ? wall_radius : column_radius;
    const double angle = turn(random);
    Track track;
    track.triangulated = true;
    track.point = {radius * std::sin(angle), radius > 1 ? 6 * share(random) - 2 : height(random),
                   radius * std::cos(angle)};
    for (int v = 0; v < views; ++v) {
      View& view = scene.views[v];
      const auto pixel = scene.cameras[0].project(view.cam_from_world * track.point);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= 240 || pixel->y() >= 400) continue;
      const Eigen::Vector3d eye = centre_of(view.cam_from_world), ray = track.point - eye;
      const auto column_hit = hit(eye, ray, column_radius);
      if (column_hit && *column_hit > 0 && *column_hit < 1 - 1e-6) continue;
      view.keypoints.push_back(*pixel);
      view.track_of.push_back(i);
      track.observations.push_back({v, static_cast<int>(view.keypoints.size()) - 1, true});
    }
    scene.tracks.push_back(std::move(track));
  }
  return column;
}

}  // namespace gyre
