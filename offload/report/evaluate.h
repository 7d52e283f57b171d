// SPDX-License-Identifier: Apache-2.0
// The figures of `gyre-offload evaluate`: a reconstructed bundle against the truth of its capture.
#pragma once

#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace gyre {

struct EvaluateOptions {
  std::string body_template;             // file; empty: searched for, see find_template
  std::size_t surface_samples = 100000;  // points that stand for the true surface
  int threads = 0;                       // 0: all cores
  std::uint64_t seed = 1;
  Progress progress = [](double, std::string_view) {};
};

// Compares the bundle with the truth in `truth_folder` (a subject's folder, see read_truth). The answer holds, in mm
// and degrees:
//   registered   share of the keyframes that got a pose, per pass too
//   cameras      centre error after the similarity over the camera centres, rotation error, and that scale
//   cloud        accuracy (cloud to true surface) and completeness (true surface to cloud), after the cameras'
//   similarity surface      both ways in the captured pose, after rigid alignment with and without scale: the whole
//   true surface to
//                the fitted one; fitted vertices that at least one true camera sees to the true surface
//   joints       distance of equally named joints, after the rigid alignment without scale
//   views        CIELAB (D65, sRGB linearised) root mean square error of re-rendered keyframes inside both silhouettes,
//   over all pixels and by view; sharpness against the keyframes'
//   seams        colour steps in the texture between photographs, within one, and where charts meet (see SeamEnergy)
//   held_out     PSNR, SSIM and CIELAB error of re-rendered frames that are no keyframes (see held_out_figures)
// A part the bundle does not have is null, with its reason under "missing". Errors only for an unreadable bundle or
// truth.
Result<nlohmann::json> evaluate(const Bundle& bundle, const std::filesystem::path& truth_folder,
                                const EvaluateOptions& options = {});

}  // namespace gyre
