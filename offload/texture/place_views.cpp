// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/place_views.h"

#include "common/parallel/parallel.h"
#include "offload/texture/common_picture.h"
#include "offload/texture/view_effects.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

namespace {

using Motion = Eigen::Matrix<double, 6, 1>;  // shift and rotation vector about the middle, world

// Of half the size, in its own exposure.
Photo halved(const Photo& photo) {
  Photo half;
  half.camera = photo.camera;
  half.camera.width = std::max(1, photo.camera.width / 2);
  half.camera.height = std::max(1, photo.camera.height / 2);
  half.camera.fx /= 2;
  half.camera.fy /= 2;
  half.camera.cx /= 2;
  half.camera.cy /= 2;
  half.cam_from_world = photo.cam_from_world;
  half.head_pass = photo.head_pass;
  const cv::Rect even(0, 0, 2 * half.camera.width, 2 * half.camera.height);
  if (photo.image.cols < even.width || photo.image.rows < even.height) {
    half.image = photo.image.clone();
  } else {
    cv::resize(photo.image(even), half.image, {half.camera.width, half.camera.height}, 0, 0, cv::INTER_AREA);
  }
  return half;
}

// How a pixel moves with the subject.
Eigen::Matrix<double, 2, 6> pixel_motion(const Photo& photo, const Eigen::Vector3d& point,
                                         const Eigen::Vector3d& middle) {
  const Eigen::Vector3d p = photo.cam_from_world * point;
  const Eigen::Matrix3d turn = photo.cam_from_world.rotation.toRotationMatrix();
  Eigen::Matrix<double, 2, 3> projection;
  projection << photo.camera.fx / p.z(), 0, -photo.camera.fx * p.x() / (p.z() * p.z()), 0, photo.camera.fy / p.z(),
      -photo.camera.fy * p.y() / (p.z() * p.z());
  const Eigen::Vector3d arm = point - middle;
  Eigen::Matrix3d crossed;  // w x arm = crossed * w
  crossed << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  Eigen::Matrix<double, 2, 6> motion;
  motion << projection * turn, projection * turn * crossed;
  return motion;
}

Pose moved(const Pose& cam_from_world, const Motion& motion, const Eigen::Vector3d& middle) {
  const Eigen::Quaterniond turn = rotation_about(motion.tail<3>());
  return cam_from_world * Pose{turn, middle + motion.head<3>() - turn * middle};
}

// One equation a pixel: its motion along the gradient.
struct Equation {
  Eigen::Matrix<double, 1, 6> row;
  double wanted = 0;  // pixels
};

std::vector<Equation> equations_of(const TriangleMesh& mesh, const Photo& photo, const CommonView& view,
                                   const cv::Mat& flow, const Eigen::Vector3d& middle, const PlaceOptions& options) {
  cv::Mat dx, dy;
  cv::Sobel(view.picture, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(view.picture, dy, CV_32F, 0, 1, 3, 0.125);
  std::vector<Equation> equations;
  for (int y = 1; y + 1 < flow.rows; y += 2) {
    for (int x = 1; x + 1 < flow.cols; x += 2) {
      if (view.known.at<std::uint8_t>(y, x) == 0) continue;
      Eigen::RowVector2d gradient(dx.at<float>(y, x), dy.at<float>(y, x));
      gradient /= std::hypot(gradient.norm(), options.least_detail);
      const std::size_t i = view.seen.index(x, y);
      const Eigen::Vector3i& corners = mesh.triangles[view.seen.triangle[i]];
      const Eigen::Vector2d w = view.seen.weights[i].cast<double>();
      const Eigen::Vector3d point = (1 - w.x() - w.y()) * mesh.vertices[corners[0]] +
                                    w.x() * mesh.vertices[corners[1]] + w.y() * mesh.vertices[corners[2]];
      const cv::Vec2f& by = flow.at<cv::Vec2f>(y, x);
      equations.push_back(
          {gradient * pixel_motion(photo, point, middle), gradient.dot(Eigen::RowVector2d(by[0], by[1]))});
    }
  }
  return equations;
}

// What is to be added to the motion found so far.
Motion solve(const std::vector<Equation>& equations, const Motion& so_far, const PlaceOptions& options) {
  constexpr double noise = 0.5;   // pixels
  constexpr double alike = 25.0;  // pixels that err together
  Motion prior;
  prior << Eigen::Vector3d::Constant(1 / (options.shift * options.shift)),
      Eigen::Vector3d::Constant(1 / (options.turn * options.turn));
  Motion motion = Motion::Zero();
  constexpr int reweightings = 4;
  for (int round = 0; round < reweightings; ++round) {
    Eigen::Matrix<double, 6, 6> matrix = prior.asDiagonal();
    Motion right = -prior.cwiseProduct(so_far);
    for (const Equation& e : equations) {
      const double off = std::abs(e.row.dot(motion) - e.wanted);
      const double weight = (off > noise && round > 0 ? noise / off : 1.0) / (alike * noise * noise);
      matrix += weight * e.row.transpose() * e.row;
      right += weight * e.wanted * e.row.transpose();
    }
    motion = matrix.ldlt().solve(right);
  }
  return motion;
}

}  // namespace

std::vector<Pose> place_views(const TriangleMesh& mesh, std::span<const Eigen::Vector3d> normals,
                              std::span<const std::uint8_t> skip, std::span<const Photo> photos,
                              const SightOptions& sight, const ViewLimits& limits, const PlaceOptions& options,
                              int threads) {
  std::vector<Photo> halves(photos.size());
  std::vector<DepthMap> depths(photos.size());
  parallel_for(photos.size(), threads, [&](std::size_t p) {
    halves[p] = halved(photos[p]);
    depths[p] = map_depth(mesh, halves[p], sight);
  });
  const PhotographedSurface surface{mesh, normals, halves, depths, sight, limits};
  const ObservationTable table = observe(surface, skip, threads);
  const std::vector<Eigen::Vector3d> gains = exposure_gains(table, static_cast<int>(photos.size()));
  for (std::size_t p = 0; p < photos.size(); ++p) halves[p].tone = ToneCurve(gains[p]);

  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : mesh.vertices) middle += v / static_cast<double>(mesh.vertices.size());
  const Atlas atlas = map_atlas(mesh.uv, mesh.uv_triangles, options.size, 1);
  constexpr int least_side = 24;  // pixels a picture needs for a flow
  std::vector<Motion> motions(photos.size(), Motion::Zero());
  double last_moved = std::numeric_limits<double>::infinity();
  for (int round = 0; round < options.rounds && last_moved > options.settled; ++round) {
    const std::vector<Motion> before = motions;
    const cv::Mat picture = common_picture(surface, table, atlas, static_cast<std::size_t>(options.views), threads);
    parallel_for(photos.size(), threads, [&](std::size_t p) {
      const Photo& photo = halves[p];
      if (std::min(photo.image.rows, photo.image.cols) < least_side) return;
      const cv::Mat grey = grey_of(photo);
      const CommonView view = render_common(surface, photo, depths[p], picture, grey, options.edge_margin);
      if (cv::countNonZero(view.known) == 0) return;
      cv::Mat flow;
      cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)->calc(view.picture, grey, flow);
      // The flow is drawn towards none by what is left out of it.
      constexpr double further = 1.3;
      motions[p] += further * solve(equations_of(mesh, photo, view, flow, middle, options), motions[p], options);
    });
    double squared = 0;
    for (std::size_t p = 0; p < photos.size(); ++p) {
      halves[p].cam_from_world = moved(photos[p].cam_from_world, motions[p], middle);
      squared += (motions[p] - before[p]).head<3>().squaredNorm();
    }
    last_moved = std::sqrt(squared / static_cast<double>(photos.size()));
  }
  std::vector<Pose> placed;
  for (const Photo& half : halves) placed.push_back(half.cam_from_world);
  return placed;
}

}  // namespace gyre
