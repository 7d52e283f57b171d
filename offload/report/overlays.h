// SPDX-License-Identifier: Apache-2.0
// The avatar laid over photographs, and how far its surface is from the cloud.
#pragma once

#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh.h"

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace gyre {

struct Overlay {
  std::string name;  // file name of the keyframe
  cv::Mat photo;     // 8-bit BGR
  cv::Mat avatar;    // the photograph with the avatar drawn where it stands
};

// Keyframes of a pass that look from as evenly spread directions as `count` allows; fewer when there are fewer. The
// first looks from nearest to `facing` (radians, azimuth of where the subject looks).
std::vector<const ModelImage*> spread_views(const ColmapModel& model, const std::string& pass, double facing,
                                            std::size_t count);

// The photograph reduced to `height` pixels and the same with the mesh drawn over it. Empty pictures when the
// photograph cannot be read. `posed` is in the world of the model.
Overlay make_overlay(const ColmapModel& model, const ModelImage& image, const std::filesystem::path& photo,
                     const TriangleMesh& posed, const cv::Mat& texture, int height);

// Colours of distances in millimetres: white at 0, through yellow and red to black at `most`; grey where there is none.
std::vector<Rgb> heat_colours(const std::vector<double>& distances_mm, double most_mm);

}  // namespace gyre
