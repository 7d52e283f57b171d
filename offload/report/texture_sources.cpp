// SPDX-License-Identifier: Apache-2.0
#include "offload/report/texture_sources.h"

#include <array>
#include <opencv2/core.hpp>

namespace gyre {

std::span<const OriginKind> origin_kinds() {
  static const std::array<OriginKind, 5> kinds = {
      {{"within_45_deg", "photographs that look straight at it", {58, 130, 106}},
       {"within_75_deg_or_near_edge", "photographs that look askance or close past an edge", {226, 178, 74}},
       {"mirrored", "its mirror image on the other side", {75, 108, 183}},
       {"filled", "what lies around it; no photograph shows it", {200, 85, 61}},
       {"generated", "generated, in the person's colours", {155, 122, 181}}}};
  return kinds;
}

cv::Mat colour_origins(const cv::Mat& origin, const nlohmann::json& texture) {
  const auto numbers = texture.is_object() ? texture.find("origins") : texture.end();
  if (origin.type() != CV_8U || !texture.is_object() || numbers == texture.end() || !numbers->is_object()) return {};
  cv::Mat table(1, 256, CV_8UC3, cv::Scalar::all(255));
  for (const OriginKind& kind : origin_kinds()) {
    const auto number = numbers->find(kind.name);
    if (number == numbers->end() || !number->is_number_integer()) continue;
    const auto value = number->get<std::int64_t>();
    if (value < 0 || value > 255) continue;
    table.at<cv::Vec3b>(0, static_cast<int>(value)) = {kind.colour[2], kind.colour[1], kind.colour[0]};
  }
  cv::Mat coloured(origin.size(), CV_8UC3);
  for (int y = 0; y < origin.rows; ++y)
    for (int x = 0; x < origin.cols; ++x)
      coloured.at<cv::Vec3b>(y, x) = table.at<cv::Vec3b>(0, origin.at<std::uint8_t>(y, x));
  return coloured;
}

}  // namespace gyre
