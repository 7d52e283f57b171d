// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/dense_cloud.h"

#include "common/parallel/parallel.h"
#include "offload/cloud/voxel_thinning.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <thread>

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

constexpr double gib = 1024.0 * 1024 * 1024;
constexpr double program_gib = 0.1;  // that the program and its libraries take
constexpr int smallest_long_side = 160;
// Of the limit, for what stays from the first view to the last; the rest is for working memory, and later the points.
constexpr double lasting_share = 0.67;

// What lasts: the pyramid (texel and colour), the depth map, and the depths of the pass before.
double lasting_bytes(const ColmapModel& model, int long_side) {
  constexpr double bytes_a_pixel = 7 * 1.34 + (1 + 4 + 12 + 4) + 4;
  double pixels = 0;
  for (const auto& [id, image] : model.images) {
    const Camera& camera = model.camera_of(image);
    const double factor = std::min(1.0, static_cast<double>(long_side) / std::max(camera.width, camera.height));
    pixels += factor * factor * camera.width * camera.height;
  }
  return bytes_a_pixel * std::max(pixels, 1.0);
}

// The longer side at which all that lasts fits into the limit; depends on nothing but the views and the options.
Result<int> affordable_long_side(const ColmapModel& model, const DenseCloudOptions& options) {
  const double limit = lasting_share * std::max(options.memory_gib - program_gib, 0.0) * gib;
  if (lasting_bytes(model, options.long_side) <= limit) return options.long_side;
  int largest = 1;
  for (const auto& [id, camera] : model.cameras) largest = std::max({largest, camera.width, camera.height});
  largest = std::min(largest, options.long_side);
  const int affordable = static_cast<int>(largest * std::sqrt(limit / lasting_bytes(model, largest)));
  const int least = std::min(smallest_long_side, largest);
  if (affordable >= least) return affordable;
  const double needed = program_gib + lasting_bytes(model, least) / (lasting_share * gib);
  return fail(fmt::format("{:g} GiB of memory are too little for {} views", options.memory_gib, model.images.size()),
              {}, fmt::format("use --memory-gib {:.1f} or fewer keyframes", std::ceil(10 * needed) / 10));
}

// Threads whose working memory fits beside what lasts; the result is the same for any number.
int affordable_threads(const std::vector<StereoView>& views, const DenseCloudOptions& options) {
  constexpr double bytes_a_pixel = 80;  // two levels' planes and costs, and the map they become
  double pixels = 1;
  for (const StereoView& view : views) pixels = std::max(pixels, static_cast<double>(view.width()) * view.height());
  const double limit = (1 - lasting_share) * std::max(options.memory_gib - program_gib, 0.0) * gib;
  const int affordable = std::max(1, static_cast<int>(std::min(limit / (bytes_a_pixel * pixels), 4096.0)));
  const int wanted = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(wanted, 1, affordable);
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

// The parts one after the other; each is freed once it is copied.
PointCloud joined(std::vector<PointCloud> parts) {
  std::size_t count = 0;
  for (const PointCloud& part : parts) count += part.points.size();
  PointCloud cloud;
  cloud.points.reserve(count);
  cloud.normals.reserve(count);
  cloud.colours.reserve(count);
  cloud.confidence.reserve(count);
  cloud.deviation.reserve(count);
  for (PointCloud& part : parts) {
    cloud.points.insert(cloud.points.end(), part.points.begin(), part.points.end());
    cloud.normals.insert(cloud.normals.end(), part.normals.begin(), part.normals.end());
    cloud.colours.insert(cloud.colours.end(), part.colours.begin(), part.colours.end());
    cloud.confidence.insert(cloud.confidence.end(), part.confidence.begin(), part.confidence.end());
    cloud.deviation.insert(cloud.deviation.end(), part.deviation.begin(), part.deviation.end());
    part = {};
  }
  return cloud;
}

PointCloud clean(const PointCloud& cloud, std::span<const StereoView> views, std::span<const StereoDepth> maps,
                 const SubjectRegion& region, const DenseCloudOptions& options) {
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
  if (!(memory_gib > 0)) return wrong_use("option memory_gib must be positive", std::to_string(memory_gib));
  if (!(voxel > 0)) return wrong_use("option spacing_mm must be positive");
  if (max_points < 1000) return wrong_use("option max_points is too small", {}, "use 1000 or more");
  return {};
}

Result<std::vector<StereoView>> load_views(const ColmapModel& model, const std::filesystem::path& folder,
                                           const DenseCloudOptions& options, const Progress& progress) {
  std::vector<const ModelImage*> images;
  for (const auto& [id, image] : model.images) images.push_back(&image);
  std::sort(images.begin(), images.end(), [](const auto* a, const auto* b) { return a->name < b->name; });

  const auto long_side = affordable_long_side(model, options);
  if (!long_side) return tl::unexpected(long_side.error());
  if (*long_side < options.long_side) {
    spdlog::info("{} views of {} pixels would not fit into {:g} GiB: {} pixels are used", images.size(),
                 options.long_side, options.memory_gib, *long_side);
  }
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
          make_stereo_view(images[i]->name, picture, camera, images[i]->cam_from_world, *long_side, options.levels);
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
  const std::vector<double> sharpness = relative_sharpness(views, region, options.threads);
  const std::vector<char> use = views_to_use(views, region, sharpness, options.blur);
  for (std::size_t i = 0; i < views.size(); ++i)
    if (use[i] == 0) result.left_out.push_back(views[i].name);
  const std::vector<std::vector<int>> neighbours = select_neighbours(views, use, region, options.selection);
  for (const auto& list : neighbours) result.views_used += list.empty() ? 0 : 1;
  if (result.views_used == 0) {
    return fail("no two views see the subject from usable angles", {},
                "walk around the subject in smaller steps (about 10 degrees)");
  }
  clock.finish("selection");

  std::vector<std::vector<char>> still(views.size());
  if (options.turn) still = still_background(views, options.background, options.threads);
  clock.finish("background");

  const int threads = affordable_threads(views, options);
  const double cpu_before = cpu_now();
  std::vector<StereoDepth> maps(views.size());
  parallel_steps(views.size(), threads, progress, 0.05, 0.75, "matching", [&](std::size_t i) {
    maps[i] = estimate_depth(views, static_cast<int>(i), neighbours[i], region, options.matching, options.seed + i);
    put_beyond(maps[i], still[i]);
  });
  clock.finish("photometric");
  for (int pass = 0; pass < options.geometric_passes; ++pass) {
    // Each map is replaced as soon as it is made; the others are made with the depths it had.
    std::vector<std::vector<float>> depths;
    for (const StereoDepth& map : maps) depths.push_back(map.depth);
    parallel_steps(views.size(), threads, progress, 0.75, 0.95, "refining", [&](std::size_t i) {
      maps[i] = refine_depth(views, depths, maps[i], static_cast<int>(i), neighbours[i], region, options.matching,
                             options.seed + i);
      put_beyond(maps[i], still[i]);
    });
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
    PointCloud& part = parts[i];
    part = consistent_points(views, maps, static_cast<int>(i), confirming[i], region, options.consistency);
    part = selected(part, above_floor(part, options.matching.floor));
    for (float& confidence : part.confidence) confidence *= static_cast<float>(std::min(1.0, sharpness[i]));
  });
  const PointCloud fused = joined(std::move(parts));
  clock.finish("fusion");

  result.cloud = clean(fused, views, maps, region, options);
  clock.finish("filters");
  if (result.cloud.points.empty()) {
    return fail("nothing dense was found in the box around the subject", {},
                "check that the subject stands still in even light and fills the picture");
  }
  result.height = robust_height(result.cloud);
  // The floor is no better known than the points that are taken for it; the top, than how the highest points spread.
  result.height_deviation =
      std::hypot(options.matching.floor.certain_height, result.height - robust_height(result.cloud, 1.0 / 1000));

  const PointViews seen_by = views_that_see(result.cloud, views, maps, options.free_space, options.threads);
  for (std::size_t i = 0; i < result.cloud.points.size(); ++i) {
    result.cloud.views.push_back(static_cast<std::uint8_t>(std::min<std::size_t>(seen_by.of(i).size(), 255)));
  }
  const auto sight = [&](const Eigen::Vector3d& x) { return count_sight(x, views, maps, options.free_space); };
  result.coverage = measure_coverage(result.cloud, seen_by, views, region, sight, {.spacing = options.voxel});
  clock.finish("coverage");
  return result;
}

double robust_height(const PointCloud& cloud, double share) {
  if (cloud.points.empty()) return 0.0;
  std::vector<float> heights;
  heights.reserve(cloud.points.size());
  for (const Eigen::Vector3f& x : cloud.points) heights.push_back(x.y());
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(heights.size()));
  std::nth_element(heights.begin(), heights.begin() + rank, heights.end(), std::greater<>());
  return heights[rank];
}

}  // namespace gyre
