// SPDX-License-Identifier: Apache-2.0
// The colours of a person's eyes, from the photographs that look into them.
#pragma once

#include "offload/body/template.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

// Encoded BGR.
struct EyeColours {
  Eigen::Vector3f iris;
  std::optional<Eigen::Vector3f> sclera;
};

// Median colours of the parts "leftEye" and "rightEye" where photographs that look at the face from within 40 degrees
// see the iris (13 to 25 degrees from the axis, between pupil and rim) and the white beside it (35 to 50 degrees), in
// front of which the lids must not lie. posed: the template's vertices in the pose of the photographs, metres, world.
// Nothing when fewer than 12 places of either are seen, or the iris is not the darker one: the eyes are closed. No
// white where what is beside the iris is too colourful for one, which is the skin of lids that the fit has opened too
// far.
std::optional<EyeColours> measure_eyes(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& posed,
                                       std::span<const Photo> photos, int threads);

}  // namespace gyre
