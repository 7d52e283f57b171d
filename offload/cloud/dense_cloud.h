// SPDX-License-Identifier: Apache-2.0
// From calibrated keyframes to an oriented, coloured cloud of the subject: the whole of dense stereo and fusion.
#pragma once

#include "common/geometry/colmap_model.h"
#include "common/log/log.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/cloud/cloud_filters.h"
#include "offload/cloud/consistency.h"
#include "offload/cloud/coverage.h"
#include "offload/cloud/free_space.h"
#include "offload/cloud/patch_match.h"
#include "offload/cloud/sharpness.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/still_background.h"
#include "offload/cloud/subject_region.h"
#include "offload/cloud/view_selection.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace gyre {

struct DenseCloudOptions {
  int long_side = 640;               // pixels, working size of a view
  int levels = 3;                    // of the image pyramid
  int geometric_passes = 1;          // after the photometric estimate
  double voxel = 0.002;              // metres between points of the result
  std::size_t max_points = 1000000;  // the voxels grow until the cloud is smaller
  bool turn = false;                 // the camera is fixed and the subject turns: what stays in the pictures is not it
  StillBackgroundOptions background;
  BlurOptions blur;
  ViewSelectionOptions selection;
  PatchMatchOptions matching;
  ConfirmationOptions consistency;
  FreeSpaceOptions free_space;
  ClusterOptions clusters;
  double memory_gib = 4.0;  // the working size shrinks until the estimate is below, and fewer threads may work at once
  int threads = 0;
  std::uint64_t seed = 1;

  Result<void> check() const;
};

struct DenseCloud {
  PointCloud cloud;
  Coverage coverage;
  int views_used = 0;                                   // that had neighbours to match against
  std::vector<std::string> left_out;                    // views whose blur others make up for
  double height = 0;                                    // metres from the floor to the top of the cloud, robustly
  double height_deviation = 0;                          // standard deviation of the height, metres
  double megapixels = 0;                                // of depth estimated at the working size
  std::vector<std::pair<std::string, double>> seconds;  // wall time of each step
  double cpu_seconds = 0;                               // of the process while depth was estimated
};

// Reads the model's images from `folder` and prepares the views, in the order of their names. Error when a picture is
// missing or not of its camera's size, or the memory limit leaves less than 160 pixels a view.
Result<std::vector<StereoView>> load_views(const ColmapModel& model, const std::filesystem::path& folder,
                                           const DenseCloudOptions& options, const Progress& progress);

// Neighbours, depth maps, geometric passes, fusion, floor, specks, clusters, thinning, coverage. Errors: fewer than
// three views, no view with a neighbour, nothing found in the region.
Result<DenseCloud> build_cloud(const std::vector<StereoView>& views, const SubjectRegion& region,
                               const DenseCloudOptions& options, const Progress& progress);

// From the floor (y = 0) to the top of the cloud: the height above which `share` of the points lie, metres.
double robust_height(const PointCloud& cloud, double share = 1.0 / 2000);

}  // namespace gyre
