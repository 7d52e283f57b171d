// SPDX-License-Identifier: Apache-2.0
// How well the textured fit predicts frames that it was not made from.
#pragma once

#include "common/bundle/bundle.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/report/truth.h"

#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <span>

namespace gyre {

// Renders `mesh` (metres, world of the bundle, with `albedo`) into the true cameras of every 15th sharp frame of the
// truth's videos that is no keyframe, and compares inside both silhouettes: mean PSNR (dB), SSIM and CIELAB root mean
// square error. Error: no video, or no such frame.
Result<nlohmann::json> held_out_figures(const Truth& truth, std::span<const FrameId> keyframes,
                                        const Similarity& truth_from_bundle, const TriangleMesh& mesh,
                                        const cv::Mat& albedo);

}  // namespace gyre
