// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/verification.h"

#include "common/geometry/quantile.h"
#include "offload/cameras/triangulation.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

struct MatchedPoints {
  std::vector<cv::Point2d> a, b;
};

MatchedPoints matched_points(std::span<const Eigen::Vector2d> points_a, std::span<const Eigen::Vector2d> points_b,
                             std::span<const Match> matches) {
  MatchedPoints points;
  points.a.reserve(matches.size());
  points.b.reserve(matches.size());
  for (const Match& m : matches) {
    const Eigen::Vector2d& a = points_a[static_cast<std::size_t>(m.a)];
    const Eigen::Vector2d& b = points_b[static_cast<std::size_t>(m.b)];
    points.a.emplace_back(a.x(), a.y());
    points.b.emplace_back(b.x(), b.y());
  }
  return points;
}

Eigen::Matrix3d eigen_from(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result(r, c) = m.at<double>(r, c);
  return result;
}

}  // namespace

std::vector<Match> verify_matches(std::span<const Eigen::Vector2d> pixels_a, std::span<const Eigen::Vector2d> pixels_b,
                                  std::span<const Match> matches, const VerificationOptions& options) {
  if (static_cast<int>(matches.size()) < std::max(8, options.min_inliers)) return {};
  const MatchedPoints points = matched_points(pixels_a, pixels_b, matches);
  std::vector<unsigned char> inlier;
  try {
    cv::UsacParams usac;
    usac.confidence = options.confidence;
    usac.maxIterations = options.max_iterations;
    usac.threshold = options.max_error;
    usac.score = cv::SCORE_METHOD_MAGSAC;
    usac.sampler = cv::SAMPLING_UNIFORM;
    usac.loMethod = cv::LOCAL_OPTIM_INNER_LO;
    usac.isParallel = false;
    usac.randomGeneratorState = 0;
    cv::findFundamentalMat(points.a, points.b, inlier, usac);
  } catch (const cv::Exception&) {
    return {};
  }
  std::vector<Match> kept;
  for (std::size_t i = 0; i < inlier.size(); ++i)
    if (inlier[i] != 0) kept.push_back(matches[i]);
  if (static_cast<int>(kept.size()) < options.min_inliers) kept.clear();
  return kept;
}

Eigen::Matrix3d essential_matrix(const Pose& b_from_a) {
  const Eigen::Vector3d t = b_from_a.translation.normalized();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross * b_from_a.rotation.toRotationMatrix();
}

double sampson_distance(const Eigen::Matrix3d& essential, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d line_b = essential * a.homogeneous();
  const Eigen::Vector3d line_a = essential.transpose() * b.homogeneous();
  const double gradient2 = line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm();
  return gradient2 > 0 ? std::abs(b.homogeneous().dot(line_b)) / std::sqrt(gradient2) : 0.0;
}

std::optional<RelativePose> relative_pose(std::span<const Eigen::Vector2d> normalised_a,
                                          std::span<const Eigen::Vector2d> normalised_b, std::span<const Match> matches,
                                          double max_error) {
  if (matches.size() < 8) return std::nullopt;
  const MatchedPoints points = matched_points(normalised_a, normalised_b, matches);
  RelativePose result;
  try {
    cv::Mat mask, rotation, translation;
    const cv::Mat essential =
        cv::findEssentialMat(points.a, points.b, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, 0.999, max_error, mask);
    if (essential.rows != 3) return std::nullopt;
    cv::recoverPose(essential, points.a, points.b, cv::Mat::eye(3, 3, CV_64F), rotation, translation, 1e4, mask);
    result.b_from_a.rotation = Eigen::Quaterniond(eigen_from(rotation)).normalized();
    for (int i = 0; i < 3; ++i) result.b_from_a.translation[i] = translation.at<double>(i);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  const Eigen::Matrix3d refined = essential_matrix(result.b_from_a);
  const Pose a_from_b = result.b_from_a.inverse();
  std::vector<double> angles;
  for (const Match& m : matches) {
    const Eigen::Vector2d& a = normalised_a[static_cast<std::size_t>(m.a)];
    const Eigen::Vector2d& b = normalised_b[static_cast<std::size_t>(m.b)];
    if (sampson_distance(refined, a, b) > max_error) continue;
    const std::array<Ray, 2> rays{Ray{Eigen::Vector3d::Zero(), a.homogeneous().normalized()},
                                  Ray{a_from_b.translation, a_from_b.rotation * b.homogeneous().normalized()}};
    const auto point = intersect_rays(rays);
    if (!point || point->z() <= 0 || (result.b_from_a * *point).z() <= 0) continue;
    result.inliers.push_back(m);
    angles.push_back(angle_between_rays(rays[0], rays[1]));
  }
  if (result.inliers.size() < 8) return std::nullopt;
  result.median_angle = median(std::move(angles));
  return result;
}

}  // namespace gyre
