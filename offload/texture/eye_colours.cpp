// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/eye_colours.h"

#include "common/parallel/parallel.h"
#include "offload/texture/depth_map.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

constexpr double one_degree = 0.017453292519943295;
constexpr std::size_t enough_places = 12;
constexpr float least_contrast = 10.0F;  // of lightness L*
constexpr float most_chroma = 14.0F;     // of a white

struct Place {
  Eigen::Vector3d point, normal;
  bool iris = false;
};

struct Eyes {
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::vector<Place> places;
};

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& vertices, const TemplatePart& part) {
  Eigen::Vector3d low = vertices[part.first_vertex];
  Eigen::Vector3d high = low;
  for (int v = part.first_vertex; v < part.first_vertex + part.vertex_count; ++v) {
    low = low.cwiseMin(vertices[v]);
    high = high.cwiseMax(vertices[v]);
  }
  return 0.5 * (low + high);
}

// Triangles by their angle from the axis at rest, where the eyes look along +Z.
Eyes find_eyes(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& posed) {
  Eyes eyes;
  int found = 0;
  for (const char* name : {"leftEye", "rightEye"}) {
    const TemplatePart* part = body.part(name);
    if (part == nullptr || part->vertex_count == 0) continue;
    const Eigen::Vector3d rest_middle = middle_of(body.mesh.vertices, *part);
    const Eigen::Vector3d posed_middle = middle_of(posed, *part);
    eyes.middle += posed_middle;
    ++found;
    for (int t = part->first_triangle; t < part->first_triangle + part->triangle_count; ++t) {
      const Eigen::Vector3i& c = body.mesh.triangles[t];
      const auto centroid = [&](const std::vector<Eigen::Vector3d>& v) {
        return Eigen::Vector3d((v[c[0]] + v[c[1]] + v[c[2]]) / 3.0);
      };
      const double angle =
          std::acos(std::clamp((centroid(body.mesh.vertices) - rest_middle).normalized().z(), -1.0, 1.0)) / one_degree;
      const Eigen::Vector3d point = centroid(posed);
      const Eigen::Vector3d normal = (point - posed_middle).normalized();
      if (angle < 25) eyes.forward += normal;
      if ((angle > 13 && angle < 25) || (angle > 35 && angle < 50)) eyes.places.push_back({point, normal, angle < 30});
    }
  }
  if (found > 0) eyes.middle /= found;
  eyes.forward.normalize();
  return eyes;
}

Eigen::Vector3f median(std::vector<Eigen::Vector3f> colours) {
  Eigen::Vector3f result;
  const auto middle = colours.begin() + static_cast<std::ptrdiff_t>(colours.size() / 2);
  for (int c = 0; c < 3; ++c) {
    std::nth_element(colours.begin(), middle, colours.end(), [c](const auto& a, const auto& b) { return a[c] < b[c]; });
    result[c] = (*middle)[c];
  }
  return result;
}

}  // namespace

std::optional<EyeColours> measure_eyes(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& posed,
                                       std::span<const Photo> photos, int threads) {
  const Eyes eyes = find_eyes(body, posed);
  if (eyes.places.empty()) return std::nullopt;
  TriangleMesh mesh;
  mesh.vertices = posed;
  mesh.triangles = body.mesh.triangles;
  SightOptions sight;
  sight.depth_margin = 0.0005;                                        // lids lie closely on the eye
  constexpr double least_edge = 2.0;                                  // pixels from the lids
  std::vector<std::vector<Eigen::Vector3f>> seen(2 * photos.size());  // iris and sclera of each photograph
  parallel_for(photos.size(), threads, [&](std::size_t p) {
    const Eigen::Vector3d centre =
        -(photos[p].cam_from_world.rotation.conjugate() * photos[p].cam_from_world.translation);
    if ((centre - eyes.middle).normalized().dot(eyes.forward) < std::cos(40 * one_degree)) return;
    const DepthMap depth = map_depth(mesh, photos[p], sight);
    for (const Place& place : eyes.places) {
      const auto found = see(photos[p], depth, place.point, place.normal, sight);
      if (!found || found->cosine < 0.7 || found->edge_distance < least_edge) continue;
      seen[2 * p + (place.iris ? 0 : 1)].push_back(sample(photos[p], found->pixel));
    }
  });
  std::vector<Eigen::Vector3f> iris, sclera;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    auto& all = k % 2 == 0 ? iris : sclera;
    all.insert(all.end(), seen[k].begin(), seen[k].end());
  }
  if (iris.size() < enough_places || sclera.size() < enough_places) return std::nullopt;
  const Eigen::Vector3f beside = median(std::move(sclera));
  EyeColours colours{median(std::move(iris)), {}};
  const Eigen::Vector3f lab = lab_from_bgr(beside);
  if (lab[0] < lab_from_bgr(colours.iris)[0] + least_contrast) return std::nullopt;
  if (std::hypot(lab[1], lab[2]) <= most_chroma) colours.sclera = beside;
  return colours;
}

}  // namespace gyre
