// SPDX-License-Identifier: Apache-2.0
#include "common/qr/qr_text.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

namespace gyre {

std::vector<std::vector<bool>> qr_modules(std::string_view text) {
  constexpr int quiet_zone = 4;
  cv::Mat code;
  cv::QRCodeEncoder::create()->encode(std::string(text), code);
  // OpenCV brings a narrower margin along, whose width it does not promise.
  cv::Mat dark = code == 0;
  const cv::Rect symbol = cv::boundingRect(dark);
  std::vector<std::vector<bool>> modules(static_cast<std::size_t>(symbol.height + 2 * quiet_zone),
                                         std::vector<bool>(static_cast<std::size_t>(symbol.width + 2 * quiet_zone)));
  for (int y = 0; y < symbol.height; ++y) {
    for (int x = 0; x < symbol.width; ++x) {
      modules[static_cast<std::size_t>(y + quiet_zone)][static_cast<std::size_t>(x + quiet_zone)] =
          dark.at<uchar>(symbol.y + y, symbol.x + x) != 0;
    }
  }
  return modules;
}

std::string qr_text(const std::vector<std::vector<bool>>& modules) {
  constexpr const char* black_on_white = "\033[30;107m";
  constexpr const char* usual = "\033[0m";
  constexpr const char* halves[2][2] = {{" ", "▄"}, {"▀", "█"}};
  std::string text;
  for (std::size_t y = 0; y < modules.size(); y += 2) {
    text += black_on_white;
    for (std::size_t x = 0; x < modules[y].size(); ++x) {
      const bool below = y + 1 < modules.size() && modules[y + 1][x];
      text += halves[modules[y][x] ? 1 : 0][below ? 1 : 0];
    }
    text += std::string(usual) + "\n";
  }
  return text;
}

}  // namespace gyre
