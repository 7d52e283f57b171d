// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/resection.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace gyre {

std::optional<Resection> resect(std::span<const Eigen::Vector2d> normalised, std::span<const Eigen::Vector3d> points,
                                double max_error, int min_inliers) {
  if (static_cast<int>(points.size()) < std::max(4, min_inliers)) return std::nullopt;
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> image;
  for (std::size_t i = 0; i < points.size(); ++i) {
    world.emplace_back(points[i].x(), points[i].y(), points[i].z());
    image.emplace_back(normalised[i].x(), normalised[i].y());
  }
  Resection result;
  try {
    const cv::Mat identity = cv::Mat::eye(3, 3, CV_64F);
    cv::Mat rotation, translation;
    if (!cv::solvePnPRansac(world, image, identity, cv::noArray(), rotation, translation, false, 2000,
                            static_cast<float>(max_error), 0.9999, result.inliers, cv::SOLVEPNP_AP3P))
      return std::nullopt;
    if (static_cast<int>(result.inliers.size()) < min_inliers) return std::nullopt;
    std::vector<cv::Point3d> inlier_world;
    std::vector<cv::Point2d> inlier_image;
    for (const int i : result.inliers) {
      inlier_world.push_back(world[static_cast<std::size_t>(i)]);
      inlier_image.push_back(image[static_cast<std::size_t>(i)]);
    }
    cv::solvePnPRefineLM(inlier_world, inlier_image, identity, cv::noArray(), rotation, translation);
    const Eigen::Vector3d axis_angle(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
    const double angle = axis_angle.norm();
    if (angle > 0) result.cam_from_world.rotation = Eigen::AngleAxisd(angle, axis_angle / angle);
    for (int i = 0; i < 3; ++i) result.cam_from_world.translation[i] = translation.at<double>(i);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  result.inliers.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = result.cam_from_world * points[i];
    if (p.z() > 0 && (p.hnormalized() - normalised[i]).norm() < max_error)
      result.inliers.push_back(static_cast<int>(i));
  }
  if (!result.cam_from_world.translation.allFinite() || static_cast<int>(result.inliers.size()) < min_inliers)
    return std::nullopt;
  return result;
}

Pose refine_pose(Pose pose, std::span<const Eigen::Vector2d> normalised, std::span<const Eigen::Vector3d> points,
                 double width) {
  for (int round = 0; round < 20; ++round) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = pose * points[i];
      if (p.z() <= 0) continue;
      const Eigen::Vector2d error = p.hnormalized() - normalised[i];
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
      Eigen::Matrix<double, 3, 6> point_by_motion;
      point_by_motion << Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero();
      point_by_motion.rightCols<3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
      const Eigen::Matrix<double, 2, 6> by_motion = by_point * point_by_motion;
      const double weight = 1 / (1 + error.squaredNorm() / (width * width));
      normal += weight * by_motion.transpose() * by_motion;
      right -= weight * by_motion.transpose() * error;
    }
    const Eigen::Matrix<double, 6, 1> step = normal.ldlt().solve(right);
    if (!step.allFinite()) break;
    const Eigen::Vector3d turn = step.tail<3>();
    const double angle = turn.norm();
    const Eigen::Quaterniond q(angle > 0 ? Eigen::AngleAxisd(angle, turn / angle)
                                         : Eigen::AngleAxisd(0, Eigen::Vector3d::UnitX()));
    pose.rotation = (q * pose.rotation).normalized();
    pose.translation = q * pose.translation + step.head<3>();
    if (step.norm() < 1e-9) break;
  }
  return pose;
}

}  // namespace gyre
