// SPDX-License-Identifier: Apache-2.0
#include "common/video/orient.h"

#include <opencv2/core.hpp>

namespace gyre {

namespace {

constexpr int flip_rows = 0;
constexpr int flip_columns = 1;

cv::Mat flipped(const cv::Mat& image, int code) {
  cv::Mat out;
  cv::flip(image, out, code);
  return out;
}

cv::Mat rotated(const cv::Mat& image, cv::RotateFlags code) {
  cv::Mat out;
  cv::rotate(image, out, code);
  return out;
}

}  // namespace

cv::Mat oriented(const cv::Mat& stored, Orientation orientation) {
  switch (orientation) {
    case Orientation::upright:
      return stored;
    case Orientation::mirrored:
      return flipped(stored, flip_columns);
    case Orientation::rotated_180:
      return rotated(stored, cv::ROTATE_180);
    case Orientation::flipped:
      return flipped(stored, flip_rows);
    case Orientation::transposed:
      return stored.t();
    case Orientation::rotated_90:
      return rotated(stored, cv::ROTATE_90_CLOCKWISE);
    case Orientation::transversed:
      return flipped(rotated(stored, cv::ROTATE_90_CLOCKWISE), flip_rows);
    case Orientation::rotated_270:
      return rotated(stored, cv::ROTATE_90_COUNTERCLOCKWISE);
  }
  return stored;
}

}  // namespace gyre
