// SPDX-License-Identifier: Apache-2.0
// Photographs in, one texture in the layout of the mesh's own texture coordinates out.
#pragma once

#include "common/log/log.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/texture/align.h"
#include "offload/texture/gradient_blend.h"
#include "offload/texture/labelling.h"
#include "offload/texture/observations.h"
#include "offload/texture/photo.h"
#include "offload/texture/place_views.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

struct BakeOptions {
  int size = 4096;  // texels a side
  int rim = 2;      // texels every chart continues beyond its border
  bool equalise_exposure = true;
  bool cut_and_blend = true;  // false: best view a triangle, nothing smoothed (what the better result is compared with)
  bool place = true;          // photographs where a subject that moved saw them from; only with cut_and_blend
  bool align = true;          // what is left, within each photograph; only with cut_and_blend
  double head_preference = 1.5;  // factor on the score of head views on the head, and of body views elsewhere
  SightOptions sight;
  ViewLimits limits;
  PlaceOptions placing;
  AlignOptions alignment;
  LabelOptions labels;
  GradientOptions gradients;

  Result<void> check() const;
};

// The surface in the pose of the photographs: metres, world, with texture coordinates. Arrays are one a triangle, or
// empty.
struct BakeSubject {
  TriangleMesh mesh;
  std::vector<std::uint8_t> head;       // 1: belongs to the head
  std::vector<std::uint8_t> feature;    // 1 and up: parts of the face that one photograph has to show whole
  std::vector<std::uint8_t> hidden;     // 1: no photograph shows it; a part of what is generated
  std::vector<std::uint8_t> generated;  // 1 and up: coloured by `generate` and not from photographs
  std::function<void(const Atlas& atlas, const Canvas& canvas)> match;  // called with the blended photographs before
  std::function<Eigen::Vector3f(int triangle, const Eigen::Vector3d& weights)> generate;  // encoded BGR
  std::vector<int> mirror;  // one a vertex: its mirror vertex, -1: none; or empty
};

struct BakedTexture {
  cv::Mat albedo;  // 8-bit BGR, size x size, no texel without colour
  cv::Mat source;  // 8-bit BGR: one colour a photograph; black: no surface, dark grey: filled, light grey: mirrored,
                   // white: generated
  cv::Mat view;    // 16-bit: 1 + the photograph a texel shows, 0: none
  cv::Mat origin;  // 8-bit: TexelOrigin
  cv::Mat confidence;                  // 8-bit: 255 for what the sharpest photographs see head-on, 0 for invented
  std::vector<std::size_t> texels_of;  // of each photograph
  std::array<std::size_t, texel_origins> origins{};  // texels of the surface by TexelOrigin
  std::vector<Eigen::Vector3d> gains;                // BGR, of each photograph
  std::vector<double> sharpness;                     // of each photograph, (0, 1]
  std::vector<Pose> cam_from_world;                  // of each photograph, as it was used
};

// Methods 1.5, first part: visibility, per-view colour, alignment, labelling, blending, filling. Photographs are
// cropped in place. Error: options out of range, a mesh without texture coordinates, no photographs, or none that sees
// the mesh.
Result<BakedTexture> bake_texture(const BakeSubject& subject, std::vector<Photo> photos, const BakeOptions& options,
                                  int threads, const Progress& progress);

}  // namespace gyre
