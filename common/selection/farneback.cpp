// SPDX-License-Identifier: Apache-2.0
#include "common/selection/farneback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr int most_levels = 3;
constexpr int least_side = 32;  // of the smallest level
constexpr int iterations = 3;
constexpr int reach = 5;  // of the polynomial around a pixel
constexpr double sigma = 1.2;
constexpr int half = 7;  // of the window that flow is averaged over
constexpr int window = 2 * half + 1;
constexpr std::size_t terms = 5;

// Four values that are worked on at once.
using Four = float __attribute__((vector_size(16)));

Four four(const float* from) {
  Four values;
  std::memcpy(&values, from, sizeof(values));
  return values;
}

// Rows of several quantities, one after the other.
class Rows {
 public:
  Rows(std::size_t count, int width) : width_(static_cast<std::size_t>(width)), values_(count * width_, 0.0F) {}
  float* operator[](std::size_t row) { return values_.data() + row * width_; }

 private:
  std::size_t width_;
  std::vector<float> values_;
};

// Weights of the fit (eq. 3.8 of Farneback's thesis), by distance, and what turns the moments into coefficients.
struct Kernel {
  std::array<float, reach + 1> g{}, xg{}, xxg{};
  float linear = 0, constant = 0, quadratic = 0, mixed = 0;

  Kernel() {
    std::array<double, reach + 1> weight{};
    double sum = 0, m2 = 0, m4 = 0;
    for (int x = -reach; x <= reach; ++x) sum += std::exp(-x * x / (2 * sigma * sigma));
    for (int x = 0; x <= reach; ++x) {
      const auto i = static_cast<std::size_t>(x);
      weight[i] = std::exp(-x * x / (2 * sigma * sigma)) / sum;
      g[i] = static_cast<float>(weight[i]);
      xg[i] = static_cast<float>(x * weight[i]);
      xxg[i] = static_cast<float>(x * x * weight[i]);
      m2 += 2 * x * x * weight[i];
      m4 += 2 * std::pow(x, 4) * weight[i];
    }
    // 1, x, y, xx - m2, yy - m2 and xy are orthogonal under the weights.
    linear = static_cast<float>(1 / m2);
    quadratic = static_cast<float>(1 / (m4 - m2 * m2));
    constant = static_cast<float>(-m2 / (m4 - m2 * m2));
    mixed = static_cast<float>(1 / (m2 * m2));
  }
};

void repeat_ends(float* row, int width, int by) {
  std::fill(row - by, row, row[0]);
  std::fill(row + width, row + width + by, row[width - 1]);
}

// CV_32F in, CV_32FC(5) out.
cv::Mat expansion(const cv::Mat& image) {
  static const Kernel k;
  const int width = image.cols;
  cv::Mat out(image.size(), CV_32FC(terms));
  Rows moments(3, width + 2 * reach), fits(terms, width);
  float* const m0 = moments[0] + reach;
  float* const m1 = moments[1] + reach;
  float* const m2 = moments[2] + reach;
  for (int y = 0; y < image.rows; ++y) {
    const auto* const middle = image.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      m0[x] = k.g[0] * middle[x];
      m1[x] = m2[x] = 0;
    }
    for (int d = 1; d <= reach; ++d) {
      const auto* const above = image.ptr<float>(std::max(0, y - d));
      const auto* const below = image.ptr<float>(std::min(image.rows - 1, y + d));
      const auto i = static_cast<std::size_t>(d);
      const float g = k.g[i], xg = k.xg[i], xxg = k.xxg[i];
      for (int x = 0; x < width; ++x) {
        const float sum = above[x] + below[x];
        m0[x] += g * sum;
        m1[x] += xg * (below[x] - above[x]);
        m2[x] += xxg * sum;
      }
    }
    for (float* const row : {m0, m1, m2}) repeat_ends(row, width, reach);
    for (int x = 0; x < width; ++x) {
      const float g = k.g[0];
      float c = g * m0[x], cx = 0, cy = g * m1[x], cxx = 0, cyy = g * m2[x], cxy = 0;
      for (int d = 1; d <= reach; ++d) {
        const auto i = static_cast<std::size_t>(d);
        const float sum = m0[x + d] + m0[x - d];
        c += k.g[i] * sum;
        cxx += k.xxg[i] * sum;
        cx += k.xg[i] * (m0[x + d] - m0[x - d]);
        cy += k.g[i] * (m1[x + d] + m1[x - d]);
        cxy += k.xg[i] * (m1[x + d] - m1[x - d]);
        cyy += k.g[i] * (m2[x + d] + m2[x - d]);
      }
      fits[0][x] = cx * k.linear;
      fits[1][x] = cy * k.linear;
      fits[2][x] = c * k.constant + cxx * k.quadratic;
      fits[3][x] = c * k.constant + cyy * k.quadratic;
      fits[4][x] = cxy * k.mixed;
    }
    auto* to = out.ptr<float>(y);
    for (int x = 0; x < width; ++x) {
      for (std::size_t t = 0; t < terms; ++t) *to++ = fits[t][x];
    }
  }
  return out;
}

// Levels of the pyramid, expanded; each is made from the frame itself.
std::vector<cv::Mat> expansions(const cv::Mat& luma) {
  std::vector<cv::Mat> levels;
  cv::Mat image, smooth, small;
  luma.convertTo(image, CV_32F);
  for (int level = 0; level <= most_levels; ++level) {
    const double scale = 1 << level;
    if (level > 0 && std::min(luma.cols, luma.rows) < least_side * scale) break;
    const double blur = 0.5 * (scale - 1);
    const int side = std::max(3, cvRound(5 * blur) | 1);
    cv::GaussianBlur(image, smooth, {side, side}, blur, blur);
    const cv::Size size(cvRound(luma.cols / scale), cvRound(luma.rows / scale));
    cv::resize(smooth, small, size, 0, 0, cv::INTER_LINEAR);
    levels.push_back(expansion(small));
  }
  return levels;
}

// Flow at the borders of the picture counts less.
float border_weight(int at, int length) {
  constexpr std::array weights = {0.14F, 0.14F, 0.4472F, 0.4472F, 0.4472F};
  const int from_end = std::min(at, length - 1 - at);
  return from_end < static_cast<int>(weights.size()) ? weights[static_cast<std::size_t>(from_end)] : 1.0F;
}

// One level's flow, made better step by step. Works in place, a window of rows ahead of what it changes.
class Refinement {
 public:
  Refinement(const cv::Mat& from, const cv::Mat& to, cv::Mat& u, cv::Mat& v)
      : from_(from),
        to_(to),
        u_(u),
        v_(v),
        width_(from.cols),
        height_(from.rows),
        differences_(terms, width_),
        equations_(terms * slots, width_),
        sums_(terms, width_ + 2 * half),
        averages_(terms, width_ + 2 * half),
        weights_(1, width_) {
    for (int x = 0; x < width_; ++x) weights_[0][x] = border_weight(x, width_);
  }

  // One iteration (Farneback's eq. 15, averaged over the window).
  void step() {
    for (int y = 0; y <= std::min(half, height_ - 1); ++y) set_up(y);
    for (std::size_t t = 0; t < terms; ++t) {
      float* const sum = sums_[t] + half;
      std::fill(sum, sum + width_, 0.0F);
      for (int y = -half; y <= half; ++y) {
        const float* const row = equation(t, std::clamp(y, 0, height_ - 1));
        for (int x = 0; x < width_; ++x) sum[x] += row[x];
      }
    }
    for (int y = 0;; ++y) {
      solve(y);
      if (y + 1 == height_) return;
      if (y + 1 + half < height_) set_up(y + 1 + half);
      for (std::size_t t = 0; t < terms; ++t) {
        slide(sums_[t] + half, equation(t, std::min(height_ - 1, y + 1 + half)), equation(t, std::max(0, y - half)));
      }
    }
  }

 private:
  static constexpr std::size_t slots = window + 1;

  float* equation(std::size_t term, int y) { return equations_[term * slots + static_cast<std::size_t>(y) % slots]; }

  void slide(float* __restrict sum, const float* __restrict next, const float* __restrict last) const {
    for (int x = 0; x < width_; ++x) sum[x] += next[x] - last[x];
  }

  // What the two expansions say about each pixel of a row.
  void set_up(int y) {
    compare(y);
    weigh(differences_[0], differences_[1], differences_[2], differences_[3], differences_[4], weights_[0],
          border_weight(y, height_), u_.ptr<float>(y), v_.ptr<float>(y), equation(0, y), equation(1, y), equation(2, y),
          equation(3, y), equation(4, y));
  }

  void weigh(const float* __restrict a, const float* __restrict b, const float* __restrict xx,
             const float* __restrict yy, const float* __restrict xy, const float* __restrict weight, float row_weight,
             const float* __restrict u, const float* __restrict v, float* __restrict g11, float* __restrict g12,
             float* __restrict g22, float* __restrict h1, float* __restrict h2) const {
    for (int x = 0; x < width_; ++x) {
      const float w = weight[x] * row_weight;
      const float p = w * xx[x], q = w * yy[x], r = w * xy[x];
      const float s = w * a[x] + p * u[x] + r * v[x];
      const float t = w * b[x] + r * u[x] + q * v[x];
      g11[x] = p * p + r * r;
      g12[x] = (p + q) * r;
      g22[x] = q * q + r * r;
      h1[x] = p * s + r * t;
      h2[x] = r * s + q * t;
    }
  }

  // Half the difference of the linear coefficients, and the mean of the quadratic ones, to where flow leads.
  void compare(int y) {
    constexpr Four halves = {-0.5F, -0.5F, 0.5F, 0.5F};
    const auto* const u = u_.ptr<float>(y);
    const auto* const v = v_.ptr<float>(y);
    const auto* here = from_.ptr<float>(y);
    float* const xy = differences_[4];
    for (int x = 0; x < width_; ++x, here += terms) {
      const Four mine = four(here);
      Four there = {0, 0, mine[2], mine[3]};
      float last = here[4];
      const float at_x = static_cast<float>(x) + u[x], at_y = static_cast<float>(y) + v[x];
      const int left = cvFloor(at_x), top = cvFloor(at_y);
      if (left >= 0 && top >= 0 && left < width_ - 1 && top < height_ - 1) {
        const float fx = at_x - static_cast<float>(left), fy = at_y - static_cast<float>(top);
        const float w11 = fx * fy, w10 = fy - w11, w01 = fx - w11, w00 = 1 - fx - fy + w11;
        const float* const upper = to_.ptr<float>(top) + static_cast<std::size_t>(left) * terms;
        const float* const lower = to_.ptr<float>(top + 1) + static_cast<std::size_t>(left) * terms;
        there = w00 * four(upper) + w01 * four(upper + terms) + w10 * four(lower) + w11 * four(lower + terms);
        last = w00 * upper[4] + w01 * upper[4 + terms] + w10 * lower[4] + w11 * lower[4 + terms];
      }
      const Four difference = 0.5F * mine + halves * there;
      differences_[0][x] = difference[0];
      differences_[1][x] = difference[1];
      differences_[2][x] = difference[2];
      differences_[3][x] = difference[3];
      xy[x] = 0.25F * (here[4] + last);
    }
  }

  // Sums over the window along the row, by doubling: of 2, 4 and 8 values.
  void average(std::size_t term) {
    float* const sum = sums_[term] + half;
    repeat_ends(sum, width_, half);
    const float* const in = sums_[term];
    float* const out = averages_[term];
    const int length = width_ + 2 * half;
    two_.resize(static_cast<std::size_t>(length));
    four_.resize(static_cast<std::size_t>(length));
    float* const two = two_.data();
    float* const four = four_.data();
    for (int x = 0; x + 1 < length; ++x) two[x] = in[x] + in[x + 1];
    for (int x = 0; x + 3 < length; ++x) four[x] = two[x] + two[x + 2];
    static_assert(window == 4 + 4 + 4 + 2 + 1);
    for (int x = 0; x < width_; ++x) out[x] = four[x] + four[x + 4] + four[x + 8] + two[x + 12] + in[x + 14];
  }

  void solve(int y) {
    for (std::size_t t = 0; t < terms; ++t) average(t);
    solve(averages_[0], averages_[1], averages_[2], averages_[3], averages_[4], u_.ptr<float>(y), v_.ptr<float>(y));
  }

  void solve(const float* __restrict g11, const float* __restrict g12, const float* __restrict g22,
             const float* __restrict h1, const float* __restrict h2, float* __restrict u, float* __restrict v) const {
    constexpr float scale = 1.0F / (window * window);
    constexpr float floor = 1e-3F;  // of the determinant, where the picture has no detail
    for (int x = 0; x < width_; ++x) {
      const float a = scale * g11[x], b = scale * g12[x], c = scale * g22[x];
      const float per_determinant = scale / (a * c - b * b + floor);
      u[x] = (c * h1[x] - b * h2[x]) * per_determinant;
      v[x] = (a * h2[x] - b * h1[x]) * per_determinant;
    }
  }

  const cv::Mat& from_;
  const cv::Mat& to_;
  cv::Mat& u_;
  cv::Mat& v_;
  int width_, height_;
  Rows differences_, equations_, sums_, averages_, weights_;
  std::vector<float> two_, four_;
};

}  // namespace

cv::Mat Farneback::add(const cv::Mat& luma) {
  std::vector<cv::Mat> now = expansions(luma);
  if (before_.empty()) {
    before_ = std::move(now);
    return {};
  }
  cv::Mat u, v;
  for (std::size_t level = now.size(); level-- > 0;) {
    const cv::Size size = now[level].size();
    if (u.empty()) {
      u = cv::Mat::zeros(size, CV_32F);
      v = cv::Mat::zeros(size, CV_32F);
    } else {
      for (cv::Mat* const part : {&u, &v}) {
        cv::Mat larger;
        cv::resize(*part, larger, size, 0, 0, cv::INTER_LINEAR);
        *part = 2 * larger;
      }
    }
    Refinement refinement(before_[level], now[level], u, v);
    for (int i = 0; i < iterations; ++i) refinement.step();
  }
  before_ = std::move(now);
  cv::Mat flow;
  cv::merge(std::vector{u, v}, flow);
  return flow;
}

}  // namespace gyre
