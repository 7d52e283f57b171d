// SPDX-License-Identifier: Apache-2.0
#include "device/page/latest_picture.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds too_old{500};

std::string jpeg_of(const cv::Mat& image) {
  const double factor = static_cast<double>(LatestPicture::longer_side) / std::max(image.cols, image.rows);
  cv::Mat small = image;
  if (factor < 1.0) cv::resize(image, small, {}, factor, factor, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, LatestPicture::quality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace

void LatestPicture::set(const cv::Mat& image) {
  const std::scoped_lock lock(mutex_);
  if (image.data == image_.data) return;
  image_ = image;
  ++number_;
  set_at_ = Clock::now();
  changed_.notify_all();
}

std::optional<LatestPicture::Sent> LatestPicture::wait(std::uint64_t seen, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  ++waiting_;
  const std::uint64_t at_first = number_;
  const bool came = changed_.wait_for(lock, timeout, [&] {
    const bool is_fresh = number_ != at_first || Clock::now() - set_at_ < too_old;
    return closed_ || (!image_.empty() && number_ != seen && is_fresh);
  });
  --waiting_;
  if (!came || closed_) return std::nullopt;
  const cv::Mat image = image_;
  const std::uint64_t number = number_;
  lock.unlock();
  return Sent{number, jpeg_of(image)};
}

int LatestPicture::waiting() const {
  const std::scoped_lock lock(mutex_);
  return waiting_;
}

void LatestPicture::close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace gyre
