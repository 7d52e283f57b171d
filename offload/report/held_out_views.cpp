// SPDX-License-Identifier: Apache-2.0
#include "offload/report/held_out_views.h"

#include "common/render/rasterise.h"
#include "common/video/frame_source.h"
#include "offload/report/texture_errors.h"
#include "offload/report/view_errors.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

constexpr int every = 15;  // frames

struct Sums {
  double psnr = 0.0, ssim = 0.0, lab = 0.0;
  int views = 0;
};

// The true camera in the world of the bundle; depths come in the bundle's scale, which no projection shows.
Pose in_bundle(const Pose& cam_from_truth, const Similarity& truth_from_bundle) {
  return {
      cam_from_truth.rotation * truth_from_bundle.rotation,
      (cam_from_truth.rotation * truth_from_bundle.translation + cam_from_truth.translation) / truth_from_bundle.scale};
}

Result<void> compare_pass(const TruthPass& pass, const std::vector<int>& used, const Similarity& truth_from_bundle,
                          const TriangleMesh& mesh, const cv::Mat& albedo, Sums& sums) {
  auto video = open_capture(pass.video);
  if (!video) return tl::unexpected(video.error());
  while (true) {
    const auto frame = (*video)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return {};
    const int index = (*frame)->index;
    const auto pose = pass.cam_from_world.find(index);
    if (index % every != every / 2 || pose == pass.cam_from_world.end() || pass.unsharp.contains(index) ||
        std::find(used.begin(), used.end(), index) != used.end()) {
      continue;
    }
    const cv::Mat& picture = (*frame)->image;
    if (picture.cols != pass.camera.width || picture.rows != pass.camera.height) {
      return fail("the video is not as large as its truth says", pass.video.string());
    }
    const Pose cam_from_bundle = in_bundle(pose->second, truth_from_bundle);
    const cv::Mat shown = silhouette(mesh, pass.camera, cam_from_bundle);
    const cv::Mat real = silhouette(pass.surface, pass.camera, pose->second);
    const cv::Mat both = shown & real;
    if (cv::countNonZero(both) == 0) continue;
    const cv::Mat rendered = render(mesh, albedo, pass.camera, cam_from_bundle, {.lit = false});
    const PictureSimilarity similarity = picture_similarity(picture, rendered, both);
    sums.psnr += similarity.psnr;
    sums.ssim += similarity.ssim;
    sums.lab += colour_error(rendered, picture, both, both).rmse();
    ++sums.views;
  }
}

}  // namespace

Result<nlohmann::json> held_out_figures(const Truth& truth, std::span<const FrameId> keyframes,
                                        const Similarity& truth_from_bundle, const TriangleMesh& mesh,
                                        const cv::Mat& albedo) {
  Sums sums;
  for (const auto& [name, pass] : truth) {
    if (pass.video.empty()) continue;
    std::vector<int> used;
    for (const FrameId& frame : keyframes) {
      if (frame.pass == name) used.push_back(frame.index);
    }
    if (auto ok = compare_pass(pass, used, truth_from_bundle, mesh, albedo, sums); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  if (sums.views == 0) return fail("the truth has no sharp frame that is no keyframe");
  return nlohmann::json{{"views", sums.views},
                        {"psnr_db", sums.psnr / sums.views},
                        {"ssim", sums.ssim / sums.views},
                        {"cielab_rmse", sums.lab / sums.views}};
}

}  // namespace gyre
