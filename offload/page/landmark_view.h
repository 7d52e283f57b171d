// SPDX-License-Identifier: Apache-2.0
// Landmarks for the page: where the found ones are in each keyframe, and what somebody picked.
#pragma once

#include "common/bundle/bundle.h"

#include <nlohmann/json.hpp>

namespace gyre {

// Where the points that were picked on the page lie in the bundle: an input of stage landmarks.
std::filesystem::path picked_file(const Bundle& bundle);

// {"names", "placed", "missing", "picked", "frames"}, see offload/page/web/model.ts. Without cameras there are no
// frames. Pixels: as common/geometry/camera.h has them.
nlohmann::json landmark_view(const Bundle& bundle);

// Keeps the picked points (offload/landmarks/picked_points.h), in place of those before; none removes the file. Errors:
// what that file would be refused for.
Result<void> keep_picked(const Bundle& bundle, const nlohmann::json& picked);

}  // namespace gyre
