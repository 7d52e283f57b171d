// SPDX-License-Identifier: Apache-2.0
// How well a slanted plane at a pixel of one view agrees with its neighbours: what PatchMatch searches the least of.
#pragma once

#include "offload/cloud/patch_cost.h"
#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// More neighbours of a view than this are not looked at.
inline constexpr int max_neighbours = 12;

// A plane as the inverse depth it gives each array index: inverse(x, y) = slope_x * x + slope_y * y + offset, which is
// exactly affine. Kept relative to its own pixel: the value there and the two slopes.
struct SlantedPlane {
  float inverse = 0;  // 1 / depth at the pixel, 0: none
  float slope_x = 0;
  float slope_y = 0;

  float inverse_at(float dx, float dy) const { return inverse + slope_x * dx + slope_y * dy; }
};

struct PlaneCostOptions {
  int best_views = 3;                // a plane is judged by the mean cost of this many of its views
  float consistency_weight = 0.15F;  // cost of a pixel of forward-backward reprojection error (geometric pass)
  float consistency_limit = 3.0F;    // pixels at which that error saturates
  PatchOptions patch;
};

// Neighbours of a view, a bit each.
using NeighbourSet = std::uint16_t;

// A pixel of the reference, with what all planes there have in common.
struct PlaneSite {
  int x = 0;
  int y = 0;
  ReferencePatch patch;
  std::array<Eigen::Vector3f, max_neighbours> base;     // of the homographies, in each of its neighbours
  std::array<std::uint8_t, max_neighbours> neighbours;  // to compare with
  std::size_t count = 0;                                // of them
};

// The cost of planes at the pixels of one view, at one level of the pyramid. Const members may be called from several
// threads.
class PlaneCost {
 public:
  // `depths`, of all views at the first level, or empty: with them a plane is also judged by whether the neighbours'
  // depths lead back to its pixel (Schönberger et al., ECCV 2016, eq. 13). Views and depths must outlive the object.
  PlaneCost(std::span<const StereoView> views, int reference, std::span<const int> neighbours, int level,
            const PlaneCostOptions& options, std::span<const std::vector<float>> depths);

  NeighbourSet all() const { return static_cast<NeighbourSet>((1U << sources_.size()) - 1U); }
  // Change of inverse depth that moves a match by about one pixel.
  float pixel_step() const { return pixel_step_; }

  PlaneSite site(int x, int y, NeighbourSet compared) const;

  // Mean cost in the site's best views; some larger value, early, once it cannot be below `limit`.
  float judge(const PlaneSite& site, const SlantedPlane& plane, float limit) const;

  // The same without a limit, and the `kept` neighbours of least cost.
  struct Ranking {
    float cost = 0;
    NeighbourSet best = 0;
  };
  Ranking rank(const PlaneSite& site, const SlantedPlane& plane, int kept) const;

 private:
  // A neighbour as the kernel needs it: q = from_reference * (x, y, 1) + translation * inverse depth is its homogeneous
  // array index, scaled by its depth over the reference's.
  struct Source {
    const QuadImage* image = nullptr;
    Eigen::Matrix3f from_reference;
    Eigen::Vector3f translation;
    // For the way back, when its depths are known.
    const float* depths = nullptr;
    Eigen::Matrix3f to_reference;
    Eigen::Vector3f back_translation;
  };

  // Of the site's n-th neighbour: where the pixel falls, and the two parts of the cost.
  Eigen::Vector3f centre_in(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const;
  float photometric(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const;
  float geometric(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const;
  float round_trip(const PlaneSite& site, const Source& source, const Eigen::Vector3f& centre) const;
  std::size_t wanted(const PlaneSite& site) const;

  const ImageLevel& image_;
  PlaneCostOptions options_;
  PatchWeights weights_;
  std::vector<Source> sources_;
  float pixel_step_ = 0;
};

}  // namespace gyre
