// SPDX-License-Identifier: Apache-2.0
// How the texels of a texture got their colours, as colours to look at.
#pragma once

#include "common/mesh/mesh.h"

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <span>

namespace gyre {

// A way for a texel to get its colour.
struct OriginKind {
  const char* name;   // in texture.json
  const char* words;  // what a person calls it
  Rgb colour;
};
std::span<const OriginKind> origin_kinds();

// 8-bit BGR picture of origin.png (8-bit): each kind in its colour, white where there is no surface. texture:
// texture.json, whose `origins` says which number is which kind. Empty for another picture or without these numbers.
cv::Mat colour_origins(const cv::Mat& origin, const nlohmann::json& texture);

}  // namespace gyre
