// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/dense_cloud.h"

#include "common/parallel/parallel.h"
#include "offload/cloud/voxel_thinning.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

double cpu_now() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// Wall time of the steps, by name.
class StepClock {
 public:
  explicit StepClock(std::vector<std::pair<std::string, double>>& seconds) : seconds_(seconds) {}

  void finish(std::string step) {
    const auto now = std::chrono::steady_clock::now();
    seconds_.emplace_back(std::move(step), std::chrono::duration<double>(now - start_).count());
    start_ = now;
  }

 private:
  std::vector<std::pair<std::string, double>>& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// parallel_for that reports how many are done, from `from` to `to` of the whole.
void parallel_steps(std::size_t count, int threads, const Progress& progress, double from, double to,
                    std::string_view what, const std::function<void(std::size_t)>& body) {
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(count, threads, [&](std::size_t i) {
    body(i);
    const std::scoped_lock lock(mutex);
    ++done;
    progress(from + (to - from) * static_cast<double>(done) / static_cast<double>(count), what);
  });
}

// The longer side at which all views' images and two sets of depth maps fit into the limit.
int affordable_long_side(const ColmapModel& model, const DenseCloudOptions& options) {
  constexpr double bytes_a_pixel = 7 * 1.34 + 2 * (1 + 4 + 12 + 4);
  double pixels = 0;
  for (const auto& [id, image] : model.images) {
    const Camera& camera = model.camera_of(image);
    const double factor = std::min(1.0, static_cast<double>(options.long_side) / std::max(camera.width, camera.height));
    pixels += factor * factor * camera.width * camera.height;
  }
  // A third is left to the fused points and their sorting.
  const double share = 0.67 * options.memory_gib * 1024 * 1024 * 1024 / (bytes_a_pixel * std::max(pixels, 1.0));
  return static_cast<int>(options.long_side * std::min(1.0, std::sqrt(share)));
}

// Views that may confirm a point: its own neighbours and those that chose it.
std::vector<std::vector<int>> mutual(const std::vector<std::vector<int>>& neighbours) {
  std::vector<std::vector<int>> both = neighbours;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    for (const int j : neighbours[i]) both[j].push_back(static_cast<int>(i));
  }
  for (std::vector<int>& list : both) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return both;
}

void append(PointCloud& cloud, const PointCloud& more) {
  cloud.points.insert(cloud.points.end(), more.points.begin(), more.points.end());
  cloud.normals.insert(cloud.normals.end(), more.normals.begin(), more.normals.end());
  cloud.colours.insert(cloud.colours.end(), more.colours.begin(), more.colours.end());
  cloud.confidence.insert(cloud.confidence.end(), more.confidence.begin(), more.confidence.end());
  cloud.deviation.insert(cloud.deviation.end(), more.deviation.begin(), more.deviation.end());
}

PointCloud clean(const PointCloud& fused, std::span<const StereoView> views, std::span<const StereoDepth> maps,
                 const SubjectRegion& region, const DenseCloudOptions& options) {
  PointCloud cloud = selected(fused, above_floor(fused, options.floor));
  double voxel = options.voxel;
  PointCloud thin = thin_by_voxels(cloud, voxel);
  while (thin.points.size() > options.max_points) {
    voxel *= 1.2;
    thin = thin_by_voxels(cloud, voxel);
  }
  thin = selected(thin, outside_free_space(thin, views, maps, options.free_space, options.threads));
  thin = selected(thin, well_surrounded(thin, 5 * voxel, 8));
  return selected(thin, subject_clusters(thin, region, options.clusters));
}

}  // namespace

Result<void> DenseCloudOptions::check() const {
  if (long_side < 64) return wrong_use("option long_side_px is too small", std::to_string(long_side), "use 64 or more");
  if (selection.count < 2 || selection.count > max_neighbours) {
    return wrong_use("option neighbours is out of range", std::to_string(selection.count),
                     "use 2 to " + std::to_string(max_neighbours));
  }
  if (consistency.min_views < 2) {
    return wrong_use("option min_views is too small", std::to_string(consistency.min_views), "use 2 or more");
  }
  if (!(voxel > 0)) return wrong_use("option spacing_mm must be positive");
  if (max_points < 1000) return wrong_use("option max_points is too small", {}, "use 1000 or more");
  return {};
}

Result<std::vector<StereoView>> load_views(const ColmapModel& model, const std::filesystem::path& folder,
                                           const DenseCloudOptions& options, const Progress& progress) {
  std::vector<const ModelImage*> images;
  for (const auto& [id, image] : model.images) images.push_back(&image);
  std::sort(images.begin(), images.end(), [](const auto* a, const auto* b) { return a->name < b->name; });

  const int long_side = affordable_long_side(model, options);
  std::vector<StereoView> views(images.size());
  std::vector<std::string> faults(images.size());
  parallel_steps(images.size(), options.threads, progress, 0.0, 0.05, "undistorting", [&](std::size_t i) {
    const Camera& camera = model.camera_of(*images[i]);
    const std::filesystem::path file = folder / images[i]->name;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
      faults[i] = "it is missing";
      return;
    }
    cv::Mat picture;
    try {
      picture = cv::imread(file, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception& e) {
      faults[i] = e.what();
      return;
    }
    if (picture.empty()) {
      faults[i] = "not a readable picture";
    } else if (picture.cols != camera.width || picture.rows != camera.height) {
      faults[i] = "not of its camera's size";
    } else {
      views[i] =
          make_stereo_view(images[i]->name, picture, camera, images[i]->cam_from_world, long_side, options.levels);
    }
  });
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (!faults[i].empty()) {
      return fail("cannot use keyframe (" + faults[i] + ")", (folder / images[i]->name).string(),
                  "run the cameras stage again on this bundle");
    }
  }
  return views;
}

Result<DenseCloud> build_cloud(const std::vector<StereoView>& views, const SubjectRegion& region,
                               const DenseCloudOptions& options, const Progress& progress) {
  if (views.size() < 3) {
    return fail("dense stereo needs at least 3 registered views", std::to_string(views.size()) + " are there",
                "capture more overlapping views");
  }
  DenseCloud result;
  StepClock clock(result.seconds);
  const std::vector<std::vector<int>> neighbours = select_neighbours(views, region, options.selection);
  for (const auto& list : neighbours) result.views_used += list.empty() ? 0 : 1;
  if (result.views_used == 0) {
    return fail("no two views see the subject from usable angles", {},
                "walk around the subject in smaller steps (about 10 degrees)");
  }
  clock.finish("selection");

  std::vector<std::vector<char>> still(views.size());
  if (options.turn) still = still_background(views, options.background, options.threads);
  clock.finish("background");

  const double cpu_before = cpu_now();
  std::vector<StereoDepth> maps(views.size());
  parallel_steps(views.size(), options.threads, progress, 0.05, 0.75, "matching", [&](std::size_t i) {
    maps[i] = estimate_depth(views, static_cast<int>(i), neighbours[i], region, options.matching, options.seed + i);
    put_beyond(maps[i], still[i]);
  });
  clock.finish("photometric");
  for (int pass = 0; pass < options.geometric_passes; ++pass) {
    std::vector<StereoDepth> refined(views.size());
    parallel_steps(views.size(), options.threads, progress, 0.75, 0.95, "refining", [&](std::size_t i) {
      refined[i] =
          refine_depth(views, maps, static_cast<int>(i), neighbours[i], region, options.matching, options.seed + i);
      put_beyond(refined[i], still[i]);
    });
    maps = std::move(refined);
  }
  clock.finish("geometric");
  result.cpu_seconds = cpu_now() - cpu_before;
  for (const StereoDepth& map : maps) {
    result.megapixels +=
        1e-6 * static_cast<double>(std::count(map.state.begin(), map.state.end(), PixelState::surface));
  }

  const std::vector<std::vector<int>> confirming = mutual(neighbours);
  std::vector<PointCloud> parts(views.size());
  parallel_steps(views.size(), options.threads, progress, 0.95, 0.98, "fusing", [&](std::size_t i) {
    parts[i] = consistent_points(views, maps, static_cast<int>(i), confirming[i], region, options.consistency);
  });
  PointCloud fused;
  for (const PointCloud& part : parts) append(fused, part);
  clock.finish("fusion");

  result.cloud = clean(fused, views, maps, region, options);
  clock.finish("filters");
  if (result.cloud.points.empty()) {
    return fail("nothing dense was found in the box around the subject", {},
                "check that the subject stands still in even light and fills the picture");
  }
  result.height = robust_height(result.cloud);

  const PointViews seen_by = views_that_see(result.cloud, views, maps, options.free_space, options.threads);
  for (std::size_t i = 0; i < result.cloud.points.size(); ++i) {
    result.cloud.views.push_back(static_cast<std::uint8_t>(std::min<std::size_t>(seen_by.of(i).size(), 255)));
  }
  const auto sight = [&](const Eigen::Vector3d& x) { return count_sight(x, views, maps, options.free_space); };
  result.coverage = measure_coverage(result.cloud, seen_by, views, region, sight, {.spacing = options.voxel});
  clock.finish("coverage");
  return result;
}

double robust_height(const PointCloud& cloud) {
  if (cloud.points.empty()) return 0.0;
  std::vector<float> heights;
  heights.reserve(cloud.points.size());
  for (const Eigen::Vector3f& x : cloud.points) heights.push_back(x.y());
  const auto rank = static_cast<std::ptrdiff_t>(heights.size() / 2000);
  std::nth_element(heights.begin(), heights.begin() + rank, heights.end(), std::greater<>());
  return heights[rank];
}

}  // namespace gyre
