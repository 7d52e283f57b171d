// SPDX-License-Identifier: Apache-2.0
// Distances between surfaces and clouds, and the alignment they are measured after.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gyre {

// `count` points spread evenly over the area of the mesh, one in each of `count` equal slices of it.
std::vector<Eigen::Vector3d> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed);

// Distance of each point to the nearest point of the mesh, or of a cloud, metres; infinite when that is empty.
// `threads` 0: all cores.
std::vector<double> distances_to_surface(std::span<const Eigen::Vector3d> points, const TriangleMesh& mesh,
                                         int threads = 0);
std::vector<double> distances_to_cloud(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> cloud,
                                       int threads = 0);

// Indices of the vertices that lie inside the picture of at least one camera with nothing of the mesh before them.
std::vector<int> visible_vertices(const TriangleMesh& mesh, std::span<const std::pair<Camera, Pose>> cameras,
                                  int threads = 0);

struct SurfaceAlignmentOptions {
  bool with_scale = false;
  int iterations = 60;
  std::size_t samples = 4000;  // on each of the two surfaces
  std::uint64_t seed = 1;
};

// target_from_source by iterated closest points in both directions (Besl and McKay, PAMI 1992), in the end without the
// pairs beyond five times the median distance (as Chetverikov et al., ICPR 2002), starting from `initial`, whose scale
// is kept when with_scale is false. Counted are the given vertices of the source and the whole target.
Similarity align_surfaces(const TriangleMesh& target, const TriangleMesh& source, std::span<const int> source_vertices,
                          const Similarity& initial, const SurfaceAlignmentOptions& options = {});

}  // namespace gyre
