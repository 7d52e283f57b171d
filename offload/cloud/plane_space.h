// SPDX-License-Identifier: Apache-2.0
// The planes the pixels of a view may lie on, at one level of the pyramid.
#pragma once

#include "common/geometry/pose.h"
#include "offload/cloud/pixel_random.h"
#include "offload/cloud/plane_cost.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gyre {

class PlaneSpace {
 public:
  // Each pixel whose ray meets the region has planes from where it enters it to `reach` times as far as where it leaves
  // it.
  PlaneSpace(const StereoView& view, int level, const SubjectRegion& region, float reach);

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t size() const { return ranges_.size(); }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }

  // Whether the pixel has planes at all.
  bool has(std::size_t pixel) const { return ranges_[pixel].most > 0; }
  void remove(std::size_t pixel) { ranges_[pixel] = {}; }

  // The ray has depth 1 in camera coordinates.
  Eigen::Vector3f ray(int x, int y) const {
    return k_inverse_ * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 1.0F);
  }
  SlantedPlane plane_from(int x, int y, float inverse, const Eigen::Vector3f& normal) const;
  Eigen::Vector3f normal_of(const SlantedPlane& plane, int x, int y) const;

  // In range and seen from the front, less than about 80 degrees from the ray.
  bool admissible(const SlantedPlane& plane, int x, int y) const;
  SlantedPlane random_plane(int x, int y, PixelRandom& random) const;

  Eigen::Vector3d world_point(int x, int y, float inverse) const;
  // Cosine between a plane's normal and +Y.
  double up(const SlantedPlane& plane, int x, int y) const;

 private:
  struct Range {
    float least = 0;  // of inverse depth; both 0: the pixel is not looked at
    float most = 0;
  };

  int width_;
  int height_;
  Pose world_from_cam_;
  Eigen::Matrix3f k_;
  Eigen::Matrix3f k_inverse_;
  Eigen::Vector3f up_;  // the world's, in camera coordinates
  std::vector<Range> ranges_;
};

// The direction moved by up to `amount` in each coordinate, unit.
Eigen::Vector3f tilted(const Eigen::Vector3f& direction, float amount, PixelRandom& random);

}  // namespace gyre
