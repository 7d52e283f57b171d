// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/gradient_blend.h"

#include "common/parallel/parallel.h"
#include "offload/texture/texel_graph.h"
#include "offload/texture/texel_solver.h"

#include <cmath>
#include <optional>

namespace gyre {

namespace {

// How much the painted colours differ too much between a texel and the next one, painted from another photograph.
class Steps {
 public:
  Steps(const PaintJob& job, const Canvas& canvas) : job_(job), canvas_(canvas) {}

  // Painted minus wanted difference; nothing where neither photograph sees both.
  std::optional<Eigen::Vector3f> between(std::int32_t i, std::int32_t j) const {
    const auto j_in_own = colour(canvas_.photo[i], j);
    const auto i_in_other = colour(canvas_.photo[j], i);
    if (!j_in_own && !i_in_other) return std::nullopt;
    // The photographs' colours differ by this at j and at i.
    const Eigen::Vector3f at_j = j_in_own ? Eigen::Vector3f(*j_in_own - canvas_.colour[j]) : Eigen::Vector3f::Zero();
    const Eigen::Vector3f at_i =
        i_in_other ? Eigen::Vector3f(canvas_.colour[i] - *i_in_other) : Eigen::Vector3f::Zero();
    return Eigen::Vector3f((at_i + at_j) / (j_in_own && i_in_other ? 2.0F : 1.0F));
  }

 private:
  std::optional<Eigen::Vector3f> colour(int photo, std::int32_t texel) const {
    const int t = job_.atlas.triangle[texel];
    const auto [quality, sight] =
        job_.surface.look(photo, texel_point(job_.surface.mesh, job_.atlas, texel), job_.surface.normals[t]);
    if (quality == ViewQuality::none) return std::nullopt;
    return sample(job_.surface.photos[photo], sight.pixel);
  }

  const PaintJob& job_;
  const Canvas& canvas_;
};

// A step between two nodes; without one they are not to be coupled.
struct Border {
  std::int32_t a = 0, b = 0;
  int side = 0;  // of a that b is on
  std::optional<Eigen::Vector3f> step;
};

}  // namespace

void blend_gradients(const PaintJob& job, std::span<const SharedEdge> edges, const GradientOptions& options,
                     int threads, Canvas& canvas) {
  std::vector<std::uint8_t> painted(canvas.photo.size());
  for (std::size_t i = 0; i < painted.size(); ++i) painted[i] = canvas.photo[i] >= 0 ? 1 : 0;
  TexelGraph graph = connect_texels(job.surface.mesh, job.atlas, edges, painted);
  const auto photo_of = [&](std::int32_t n) { return canvas.photo[graph.texel[n]]; };
  const Steps steps(job, canvas);

  std::vector<std::vector<Border>> borders(graph.first.size() - 1);
  parallel_for(borders.size(), threads, [&](std::size_t t) {
    for (std::int32_t a = graph.first[t]; a < graph.first[t + 1]; ++a) {
      for (const int side : {0, 1}) {
        const std::int32_t b = graph.neighbour[a][side];
        if (b < 0 || photo_of(a) == photo_of(b)) continue;
        borders[t].push_back({a, b, side, steps.between(graph.texel[a], graph.texel[b])});
      }
    }
  });
  std::vector<Eigen::Vector3f> right(graph.texel.size(), Eigen::Vector3f::Zero());
  const auto take_out = [&](std::int32_t a, std::int32_t b, const Eigen::Vector3f& step) {
    right[a] -= step;
    right[b] += step;
  };
  for (const auto& of_triangle : borders) {
    for (const Border& border : of_triangle) {
      if (border.step) {
        take_out(border.a, border.b, *border.step);
      } else {
        graph.neighbour[border.a][border.side] = -1;
        graph.neighbour[border.b][opposite_side(border.side)] = -1;
      }
    }
  }
  std::erase_if(graph.links, [&](const auto& link) {
    if (photo_of(link[0]) == photo_of(link[1])) return false;
    const auto step = steps.between(graph.texel[link[0]], graph.texel[link[1]]);
    if (step) take_out(link[0], link[1], *step);
    return !step;
  });

  const double fade = options.reach * job.atlas.size;
  const std::vector<float> pull(graph.texel.size(), static_cast<float>(1.0 / (fade * fade)));
  constexpr double tolerance = 5e-3;
  const std::vector<Eigen::Vector3f> offset =
      solve_on_texels(job.surface.mesh, job.atlas, graph, pull, std::move(right), tolerance, threads);
  for (std::size_t n = 0; n < offset.size(); ++n) canvas.colour[graph.texel[n]] += offset[n];
}

}  // namespace gyre
