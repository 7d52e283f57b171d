// SPDX-License-Identifier: Apache-2.0
#include "common/video/image_folder.h"

#include "common/bundle/atomic_file.h"
#include "common/video/exif.h"
#include "common/video/orient.h"

#include <algorithm>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace gyre {

namespace {

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

// The digits at the start of `text` without leading zeros; `text` loses them.
std::string_view take_number(std::string_view& text) {
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  std::string_view digits = text.substr(0, static_cast<std::size_t>(end - text.begin()));
  text.remove_prefix(digits.size());
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

bool is_picture(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

class ImageFolder : public FrameSource {
 public:
  explicit ImageFolder(const std::filesystem::path& folder) {
    info_.path = folder;
    info_.pictures = true;
  }

  Result<void> open() {
    std::error_code error;
    for (std::filesystem::directory_iterator it(info_.path, error), end; !error && it != end; it.increment(error)) {
      if (is_picture(it->path()) && it->is_regular_file(error)) files_.push_back(it->path());
    }
    if (error) return fail("cannot list the folder", info_.path.string(), error.message());
    if (files_.empty()) return fail("no JPEG or PNG pictures in the folder", info_.path.string());
    std::sort(files_.begin(), files_.end(),
              [](const auto& a, const auto& b) { return natural_less(a.filename().string(), b.filename().string()); });
    info_.expected_frames = static_cast<int>(files_.size());
    Result<std::optional<Frame>> first = decode();
    if (!first) return tl::unexpected(first.error());
    first_ = std::move(*first);
    return {};
  }

  const CaptureInfo& info() const override { return info_; }

  Result<std::optional<Frame>> next() override {
    if (first_) return std::exchange(first_, std::nullopt);
    return decode();
  }

 private:
  Result<std::optional<Frame>> decode() {
    if (count_ == files_.size()) return std::nullopt;
    const std::filesystem::path& file = files_[count_];
    Result<std::string> bytes = read_file(file);
    if (!bytes) return tl::unexpected(bytes.error());

    const ExifFacts exif = read_exif(std::as_bytes(std::span(*bytes)));
    cv::Mat stored;
    try {
      const cv::Mat buffer(1, static_cast<int>(bytes->size()), CV_8UC1, bytes->data());
      if (!bytes->empty()) stored = cv::imdecode(buffer, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception&) {
      stored.release();  // a header that claims an impossible size
    }
    if (stored.empty()) return fail("cannot read picture", file.string(), "remove it or replace it");

    Frame frame;
    frame.image = oriented(stored, exif.orientation);
    if (count_ == 0) {
      info_.width = frame.image.cols;
      info_.height = frame.image.rows;
      info_.focal_35mm = exif.focal_35mm;
    } else if (frame.image.cols != info_.width || frame.image.rows != info_.height) {
      return fail("pictures of mixed size",
                  file.string() + " is " + std::to_string(frame.image.cols) + "x" + std::to_string(frame.image.rows) +
                      ", the first is " + std::to_string(info_.width) + "x" + std::to_string(info_.height),
                  "keep the pictures of one camera in one zoom, held one way");
    }
    const bool is_jpeg = bytes->starts_with("\xff\xd8");
    if (is_jpeg && exif.orientation == Orientation::upright) frame.jpeg = std::move(*bytes);
    frame.index = static_cast<int>(count_++);
    frame.time = frame.index;
    return frame;
  }

  CaptureInfo info_;
  std::vector<std::filesystem::path> files_;
  std::optional<Frame> first_;
  std::size_t count_ = 0;
};

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  std::string_view x = a;
  std::string_view y = b;
  while (!x.empty() && !y.empty()) {
    if (is_digit(x.front()) && is_digit(y.front())) {
      const std::string_view m = take_number(x);
      const std::string_view n = take_number(y);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
    } else {
      if (x.front() != y.front()) return x.front() < y.front();
      x.remove_prefix(1);
      y.remove_prefix(1);
    }
  }
  if (x.empty() != y.empty()) return x.empty();
  return a < b;
}

Result<std::unique_ptr<FrameSource>> open_image_folder(const std::filesystem::path& folder) {
  auto pictures = std::make_unique<ImageFolder>(folder);
  if (const Result<void> opened = pictures->open(); !opened) return tl::unexpected(opened.error());
  return pictures;
}

}  // namespace gyre
