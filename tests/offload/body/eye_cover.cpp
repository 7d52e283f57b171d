// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/body/eye_cover.h"

#include "common/mesh/closest_point.h"

namespace gyre {

namespace {

constexpr double beyond = 0.006;  // metres outside of the eyeball where a lid may be

// Distance of the outermost skin, without the lining of the lids, from each of an eyeball's vertices, outwards
// positive; nothing where there is none near.
std::vector<std::optional<double>> skin_over(const BodyTemplate& body, const TemplatePart& eye,
                                             const std::vector<Eigen::Vector3d>& state) {
  const TemplatePart& skin = *body.part("body");
  const ClosestPoint surface(
      {state.data(), static_cast<std::size_t>(skin.vertex_count)},
      {body.mesh.triangles.data() + skin.first_triangle, static_cast<std::size_t>(skin.triangle_count)});
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (int v = eye.first_vertex; v < eye.first_vertex + eye.vertex_count; ++v) middle += state[v] / eye.vertex_count;
  std::vector<std::optional<double>> over;
  for (int v = eye.first_vertex; v < eye.first_vertex + eye.vertex_count; ++v) {
    const Eigen::Vector3d out = (state[v] - middle).normalized();
    const auto hit = surface.first_hit(state[v] + beyond * out, -out);
    // The margin of a lid, which turns inwards, may dip into the ball.
    const bool faces_out = hit && hit->distance < 2 * beyond && hit->normal.dot(out) > 0.5;
    over.push_back(faces_out ? std::optional(beyond - hit->distance) : std::nullopt);
  }
  return over;
}

}  // namespace

double eyeballs_through_lids(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& template_state,
                             const std::vector<Eigen::Vector3d>& state) {
  double furthest = 0.0;
  for (const char* name : {"leftEye", "rightEye"}) {
    const TemplatePart* eye = body.part(name);
    if (eye == nullptr || body.part("body") == nullptr) continue;
    const auto wanted = skin_over(body, *eye, template_state), found = skin_over(body, *eye, state);
    for (std::size_t v = 0; v < wanted.size(); ++v)
      if (wanted[v] && *wanted[v] > 0 && found[v]) furthest = std::max(furthest, -*found[v]);
  }
  return furthest;
}

}  // namespace gyre
