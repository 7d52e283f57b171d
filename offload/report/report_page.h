// SPDX-License-Identifier: Apache-2.0
// report.html: one file that needs nothing from outside itself.
#pragma once

#include "offload/report/report_facts.h"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// A keyframe and the same with the avatar in it.
struct OverlayPicture {
  std::string caption, photo, avatar;
};

// Pictures as data URIs; those that could not be made are empty.
struct ReportPictures {
  std::array<std::string, 4> avatar;    // front, its left, back, its right
  std::array<std::string, 4> cloud;     // the same sides
  std::array<std::string, 4> distance;  // the same sides, coloured by the distance to the cloud up to heat_limit_mm
  std::array<std::string, 4> views;     // the same sides, each photograph of the texture in a colour
  std::array<std::string, 4> origins;   // the same sides, by how the texture got its colour
  std::vector<OverlayPicture> overlays;
  std::vector<std::string> keyframes;  // as facts.keyframes
};

constexpr double heat_limit_mm = 10.0;

// Text that is safe between tags and inside quoted attributes.
std::string escape_html(std::string_view text);

std::string report_page(const ReportFacts& facts, const ReportPictures& pictures);

}  // namespace gyre
