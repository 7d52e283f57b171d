// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/blend.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gyre {

namespace {

// A photograph that may colour a texel.
struct Source {
  int photo = 0;
  float share = 0;
  float corner_total = 0;  // weights of the corners that know its offset
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();
};

// The photographs of a triangle's corners at a point of it.
void gather(const PaintJob& job, int triangle, const Eigen::Vector3d& weights, std::vector<Source>& sources) {
  sources.clear();
  for (int k = 0; k < 3; ++k) {
    const auto w = static_cast<float>(std::clamp(weights[k], 1e-3, 1.0));
    for (const VertexPatch& patch : job.patches[job.surface.mesh.triangles[triangle][k]]) {
      auto found = std::find_if(sources.begin(), sources.end(), [&](const auto& s) { return s.photo == patch.photo; });
      if (found == sources.end()) found = sources.insert(sources.end(), Source{patch.photo});
      found->share += w * patch.share;
      found->offset += w * patch.offset;
      found->corner_total += w;
    }
  }
  for (Source& s : sources) s.offset /= s.corner_total;
}

class TexelPainter {
 public:
  TexelPainter(const PaintJob& job, Canvas& canvas) : job_(job), canvas_(canvas) {}

  void paint(std::size_t texel) {
    const int t = job_.atlas.triangle[texel];
    if (t < 0 || job_.label[t] < 0) return;
    const Eigen::Vector3d weights = corner_weights(job_.atlas, texel);
    point_.setZero();
    for (int k = 0; k < 3; ++k) point_ += weights[k] * job_.surface.mesh.vertices[job_.surface.mesh.triangles[t][k]];
    normal_ = job_.surface.normals[t];
    gather(job_, t, weights, sources_);

    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float total = 0;
    float largest = 0;
    for (const Source& s : sources_) {
      const float weight = s.share * s.share * s.share;
      if (weight < 1e-3F) continue;
      const auto [quality, colour] = look(s.photo);
      if (quality == ViewQuality::none) continue;
      sum += weight * (colour + s.offset);
      total += weight;
      if (weight > largest) {
        largest = weight;
        note(texel, s.photo, quality);
      }
    }
    if (total > 0) {
      canvas_.colour[texel] = sum / total;
      return;
    }
    for (const Candidate& c : job_.candidates[t]) {
      const auto [quality, colour] = look(c.photo);
      if (quality == ViewQuality::none) continue;
      canvas_.colour[texel] = colour;
      note(texel, c.photo, quality);
      return;
    }
  }

 private:
  std::pair<ViewQuality, Eigen::Vector3f> look(int photo) const {
    const auto [quality, sight] = job_.surface.look(photo, point_, normal_);
    if (quality == ViewQuality::none) return {quality, Eigen::Vector3f::Zero()};
    return {quality, sample(job_.surface.photos[photo], sight.pixel)};
  }

  void note(std::size_t texel, int photo, ViewQuality quality) {
    canvas_.photo[texel] = static_cast<std::int16_t>(photo);
    canvas_.origin[texel] = quality == ViewQuality::strict ? TexelOrigin::strict : TexelOrigin::loose;
  }

  const PaintJob& job_;
  Canvas& canvas_;
  std::vector<Source> sources_;
  Eigen::Vector3d point_, normal_;
};

}  // namespace

Canvas paint(const PaintJob& job, int threads) {
  Canvas canvas;
  canvas.colour.assign(job.atlas.texels(), Eigen::Vector3f::Zero());
  canvas.origin.assign(job.atlas.texels(), TexelOrigin::none);
  canvas.photo.assign(job.atlas.texels(), -1);
  const auto size = static_cast<std::size_t>(job.atlas.size);
  parallel_for(size, threads, [&](std::size_t y) {
    TexelPainter painter(job, canvas);
    for (std::size_t x = 0; x < size; ++x) painter.paint(y * size + x);
  });
  return canvas;
}

}  // namespace gyre
