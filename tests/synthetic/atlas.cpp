// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/atlas.h"

#include "common/parallel/parallel.h"

#include <cmath>

namespace gyre::synthetic {

namespace {

// Lower left triangle of a cell: corners at these pixels (plus half); the upper right one mirrors them.
struct Cell {
  int x = 0, y = 0, side = 0;

  // Pixels of the right angle and the two other corners; one pixel of margin all around, two along the diagonal.
  std::array<Eigen::Vector2d, 3> corners(bool upper) const {
    const double low = 1.5, high = side - 3.5;
    const Eigen::Vector2d origin(x, y);
    if (!upper)
      return {origin + Eigen::Vector2d(low, low), origin + Eigen::Vector2d(high, low),
              origin + Eigen::Vector2d(low, high)};
    const double near = side - 1.5, far = 3.5;
    return {origin + Eigen::Vector2d(near, near), origin + Eigen::Vector2d(far, near),
            origin + Eigen::Vector2d(near, far)};
  }
};

}  // namespace

cv::Mat bake_atlas(const Capture& capture, TriangleMesh& mesh, int size) {
  const TriangleMesh& rest = capture.subject.mesh;
  const std::size_t pairs = (rest.triangles.size() + 1) / 2;
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(pairs))));
  const int side = size / columns;
  mesh.uv.assign(3 * rest.triangles.size(), Eigen::Vector2d::Zero());
  mesh.uv_triangles.resize(rest.triangles.size());
  cv::Mat picture(size, size, CV_8UC3, cv::Scalar::all(0));
  parallel_for(pairs, 0, [&](std::size_t pair) {
    const Cell cell{static_cast<int>(pair) % columns * side, static_cast<int>(pair) / columns * side, side};
    for (std::size_t t = 2 * pair; t < std::min(2 * pair + 2, rest.triangles.size()); ++t) {
      const bool upper = t % 2 == 1;
      const auto corners = cell.corners(upper);
      const Eigen::Vector3i& v = rest.triangles[t];
      for (int k = 0; k < 3; ++k) {
        mesh.uv[3 * t + k] = corners[k] / size;
        mesh.uv_triangles[t][k] = static_cast<int>(3 * t) + k;
      }
      Eigen::Matrix2d frame;
      frame << corners[1] - corners[0], corners[2] - corners[0];
      const Eigen::Matrix2d weights_of = frame.inverse();
      const double texel = (rest.vertices[v[1]] - rest.vertices[v[0]]).norm() / side;
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          if ((x + y >= side) != upper) continue;
          const Eigen::Vector2d w = weights_of * (Eigen::Vector2d(cell.x + x + 0.5, cell.y + y + 0.5) - corners[0]);
          const Eigen::Vector3d at =
              (1 - w.sum()) * rest.vertices[v[0]] + w[0] * rest.vertices[v[1]] + w[1] * rest.vertices[v[2]];
          const Rgb rgb =
              encode_srgb(capture.appearance.albedo(capture.subject.materials[t], at.cast<float>(),
                                                    rest.normals[v[0]].cast<float>(), static_cast<float>(texel)));
          picture.at<cv::Vec3b>(cell.y + y, cell.x + x) = {rgb[2], rgb[1], rgb[0]};
        }
    }
  });
  return picture;
}

}  // namespace gyre::synthetic
