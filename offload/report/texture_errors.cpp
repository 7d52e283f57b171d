// SPDX-License-Identifier: Apache-2.0
#include "offload/report/texture_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

double difference(const cv::Vec3f& a, const cv::Vec3f& b) {
  return cv::norm(a - b);
}

// Bilinear, borders repeated; uv in [0, 1].
cv::Vec3f colour_at(const cv::Mat& albedo, const Eigen::Vector2d& uv) {
  const double x = uv.x() * albedo.cols - 0.5;
  const double y = uv.y() * albedo.rows - 0.5;
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  cv::Vec3f sum;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const double weight = (dx == 1 ? x - x0 : x0 + 1 - x) * (dy == 1 ? y - y0 : y0 + 1 - y);
      const cv::Vec3b& c =
          albedo.at<cv::Vec3b>(std::clamp(y0 + dy, 0, albedo.rows - 1), std::clamp(x0 + dx, 0, albedo.cols - 1));
      sum += static_cast<float>(weight) * cv::Vec3f(c);
    }
  }
  return sum;
}

bool has_view(const cv::Mat& view, const Eigen::Vector2d& uv) {
  const int x = std::clamp(static_cast<int>(uv.x() * view.cols), 0, view.cols - 1);
  const int y = std::clamp(static_cast<int>(uv.y() * view.rows), 0, view.rows - 1);
  return view.at<std::uint16_t>(y, x) != 0;
}

// Mean difference over the edges of the mesh that lie at two places of the texture.
double chart_difference(const cv::Mat& albedo, const cv::Mat& view, const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, Eigen::Vector2i> places;  // of edges by their vertices
  double sum = 0.0;
  int count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      int low = k, high = (k + 1) % 3;
      if (mesh.triangles[t][low] > mesh.triangles[t][high]) std::swap(low, high);
      const Eigen::Vector2i here(mesh.uv_triangles[t][low], mesh.uv_triangles[t][high]);
      const auto [first, is_new] = places.try_emplace({mesh.triangles[t][low], mesh.triangles[t][high]}, here);
      if (is_new || first->second == here) continue;
      const Eigen::Vector2i& there = first->second;
      for (const double s : {0.25, 0.5, 0.75}) {
        const Eigen::Vector2d p = (1 - s) * mesh.uv[here[0]] + s * mesh.uv[here[1]];
        const Eigen::Vector2d q = (1 - s) * mesh.uv[there[0]] + s * mesh.uv[there[1]];
        if (!has_view(view, p) || !has_view(view, q)) continue;
        sum += difference(colour_at(albedo, p), colour_at(albedo, q));
        ++count;
      }
    }
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace

SeamEnergy seam_energy(const cv::Mat& albedo, const cv::Mat& view, const TriangleMesh& mesh) {
  double sums[2] = {0, 0};
  std::size_t counts[2] = {0, 0};
  for (int y = 0; y < albedo.rows; ++y) {
    for (int x = 0; x < albedo.cols; ++x) {
      const std::uint16_t own = view.at<std::uint16_t>(y, x);
      if (own == 0) continue;
      for (const auto& [u, v] : {std::pair(x + 1, y), std::pair(x, y + 1)}) {
        if (u >= albedo.cols || v >= albedo.rows) continue;
        const std::uint16_t other = view.at<std::uint16_t>(v, u);
        if (other == 0) continue;
        const int kind = own == other ? 1 : 0;
        sums[kind] += difference(albedo.at<cv::Vec3b>(y, x), albedo.at<cv::Vec3b>(v, u));
        ++counts[kind];
      }
    }
  }
  const auto mean = [&](int kind) { return counts[kind] > 0 ? sums[kind] / static_cast<double>(counts[kind]) : 0.0; };
  return {mean(0), mean(1), chart_difference(albedo, view, mesh)};
}

double sharpness(const cv::Mat& image, const cv::Mat& mask) {
  cv::Mat core, grey, laplacian;
  cv::erode(mask, core, cv::Mat::ones(13, 13, CV_8U));
  if (cv::countNonZero(core) == 0) return 0.0;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, grey, {0, 0}, 0.8);
  cv::Laplacian(grey, laplacian, CV_32F);
  return cv::mean(cv::abs(laplacian), core)[0];
}

PictureSimilarity picture_similarity(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  PictureSimilarity similarity;
  if (cv::countNonZero(mask) == 0) return similarity;
  const double off = cv::norm(a, b, cv::NORM_L2SQR, mask) / (3.0 * cv::countNonZero(mask));
  similarity.psnr = off > 0 ? 10.0 * std::log10(255.0 * 255.0 / off) : std::numeric_limits<double>::infinity();

  const auto blurred = [](const cv::Mat& image) {
    cv::Mat out;
    cv::GaussianBlur(image, out, {11, 11}, 1.5);
    return out;
  };
  cv::Mat p, q;
  cv::cvtColor(a, p, cv::COLOR_BGR2GRAY);
  cv::cvtColor(b, q, cv::COLOR_BGR2GRAY);
  p.convertTo(p, CV_32F);
  q.convertTo(q, CV_32F);
  // Outside the mask there is nothing to compare.
  cv::Mat outside = mask == 0;
  p.setTo(0, outside);
  q.setTo(0, outside);
  const cv::Mat mean_p = blurred(p), mean_q = blurred(q);
  const cv::Mat variance_p = blurred(p.mul(p)) - mean_p.mul(mean_p);
  const cv::Mat variance_q = blurred(q.mul(q)) - mean_q.mul(mean_q);
  const cv::Mat covariance = blurred(p.mul(q)) - mean_p.mul(mean_q);
  constexpr double c1 = 6.5025, c2 = 58.5225;  // (0.01 * 255)^2, (0.03 * 255)^2
  const cv::Mat above = (2 * mean_p.mul(mean_q) + c1).mul(2 * covariance + c2);
  const cv::Mat below = (mean_p.mul(mean_p) + mean_q.mul(mean_q) + c1).mul(variance_p + variance_q + c2);
  similarity.ssim = cv::mean(above / below, mask)[0];
  return similarity;
}

}  // namespace gyre
