// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/paint.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// Takes the colour of one photograph when it sees the texel well enough.
bool paint_from(const PaintJob& job, int photo, std::size_t texel, const Eigen::Vector3d& point, Canvas& canvas) {
  const auto [quality, sight] = job.surface.look(photo, point, job.surface.normals[job.atlas.triangle[texel]]);
  if (quality == ViewQuality::none) return false;
  canvas.colour[texel] = sample(job.surface.photos[photo], sight.pixel);
  canvas.photo[texel] = static_cast<std::int16_t>(photo);
  canvas.origin[texel] = quality == ViewQuality::strict ? TexelOrigin::strict : TexelOrigin::loose;
  canvas.confidence[texel] =
      static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(sight.cosine * job.sharpness[photo], 0.0, 1.0)));
  return true;
}

}  // namespace

Canvas paint(const PaintJob& job, int threads) {
  Canvas canvas;
  canvas.colour.assign(job.atlas.texels(), Eigen::Vector3f::Zero());
  canvas.origin.assign(job.atlas.texels(), TexelOrigin::none);
  canvas.photo.assign(job.atlas.texels(), -1);
  canvas.confidence.assign(job.atlas.texels(), 0);
  const auto size = static_cast<std::size_t>(job.atlas.size);
  parallel_for(size, threads, [&](std::size_t y) {
    for (std::size_t texel = y * size; texel < (y + 1) * size; ++texel) {
      const int t = job.atlas.triangle[texel];
      if (t < 0 || job.label[t] < 0) continue;
      const Eigen::Vector3d point = texel_point(job.surface.mesh, job.atlas, texel);
      if (paint_from(job, job.label[t], texel, point, canvas)) continue;
      for (const Candidate& c : job.candidates[t]) {
        if (paint_from(job, c.photo, texel, point, canvas)) break;
      }
    }
  });
  return canvas;
}

}  // namespace gyre
