// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/reconstruction.h"

#include "common/geometry/quantile.h"
#include "offload/cameras/resection.h"
#include "offload/cameras/tracks.h"

namespace gyre {

namespace {

// A model that grows view by view.
class Mapper {
 public:
  Mapper(Scene& scene, const std::vector<ViewPair>& pairs, const ReconstructionOptions& options)
      : scene_(scene),
        pairs_(pairs),
        pairs_of_view_(pairs_of_views(scene, pairs)),
        options_(options),
        refused_at_(scene.views.size(), 0) {}

  // Adds views until `max_views` are registered or none can be added. report(registered) is called after each.
  void grow(int max_views, const std::function<void(int)>& report) {
    int adjusted_at = scene_.registered_count();
    while (scene_.registered_count() < max_views) {
      if (!add_next_view()) {
        // Bundle adjustment may make a refused view fit; when it changes nothing more, growth has ended.
        if (scene_.registered_count() == adjusted_at) break;
        adjust_everything();
        adjusted_at = scene_.registered_count();
        std::fill(refused_at_.begin(), refused_at_.end(), 0);
        continue;
      }
      const int registered = scene_.registered_count();
      if (registered >= adjusted_at + 1 && registered >= options_.growth_between_global * adjusted_at) {
        adjust_everything();
        adjusted_at = registered;
      }
      report(registered);
    }
  }

  void adjust_everything() {
    BundleOptions bundle;
    bundle.lens = lens_freedom();
    bundle.max_points_per_view = options_.max_points_per_view;
    bundle.max_iterations = 20;
    bundle.tolerance = 1e-4;
    adjust_bundle(scene_, bundle);
    update_normalised(scene_, options_.threads);
    filter_points(scene_, options_.triangulation);
    extend_points(scene_, options_.triangulation, options_.threads);
  }

  LensFreedom lens_freedom() const {
    if (options_.known_lens) return LensFreedom::fixed;
    return scene_.registered_count() < options_.full_lens_views ? LensFreedom::focal : LensFreedom::principal;
  }

 private:
  struct Candidate {
    int view = 0;
    int cells = 0;
    std::vector<int> keypoints;  // that show a point
  };

  // How well the points a view should see are spread over its picture: occupied cells of a 12 x 12 grid.
  Candidate candidate(int v) const {
    Candidate result;
    result.view = v;
    const View& view = scene_.views[static_cast<std::size_t>(v)];
    const Camera& camera = scene_.camera_of(view);
    std::set<std::pair<int, int>> cells;
    for (std::size_t k = 0; k < view.keypoints.size(); ++k) {
      const int track = view.track_of[k];
      if (track < 0 || !scene_.tracks[static_cast<std::size_t>(track)].triangulated) continue;
      result.keypoints.push_back(static_cast<int>(k));
      cells.emplace(static_cast<int>(12 * view.keypoints[k].x() / camera.width),
                    static_cast<int>(12 * view.keypoints[k].y() / camera.height));
    }
    result.cells = static_cast<int>(cells.size());
    return result;
  }

  bool add_next_view() {
    std::vector<Candidate> candidates;
    for (std::size_t v = 0; v < scene_.views.size(); ++v) {
      if (scene_.views[v].registered || refused_at_[v] == scene_.registered_count()) continue;
      Candidate c = candidate(static_cast<int>(v));
      if (static_cast<int>(c.keypoints.size()) >= options_.min_inliers) candidates.push_back(std::move(c));
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& x, const Candidate& y) { return x.cells > y.cells; });
    for (const Candidate& c : candidates) {
      if (try_view(c)) return true;
      refused_at_[static_cast<std::size_t>(c.view)] = scene_.registered_count();
    }
    return false;
  }

  bool try_view(const Candidate& c) {
    View& view = scene_.views[static_cast<std::size_t>(c.view)];
    std::vector<Eigen::Vector2d> image;
    std::vector<Eigen::Vector3d> world;
    for (const int k : c.keypoints) {
      image.push_back(view.normalised[static_cast<std::size_t>(k)]);
      world.push_back(track_of(view, k).point);
    }
    const auto pose = resect(image, world, options_.max_pose_error / scene_.camera_of(view).fx, options_.min_inliers);
    if (!pose) return false;
    if (static_cast<double>(pose->inliers.size()) < options_.min_inlier_share * static_cast<double>(image.size()))
      return false;
    view.cam_from_world = pose->cam_from_world;
    view.registered = true;
    if (!agrees_with_pairs(scene_, pairs_, pairs_of_view_[static_cast<std::size_t>(c.view)], c.view,
                           options_.consistency)) {
      view.registered = false;
      return false;
    }
    extend_points_of_view(scene_, c.view, options_.triangulation);
    adjust_locally(c.view);
    return true;
  }

  void adjust_locally(int v) {
    std::map<int, int> shared;
    for (const int t : scene_.views[static_cast<std::size_t>(v)].track_of) {
      if (t < 0 || !scene_.tracks[static_cast<std::size_t>(t)].triangulated) continue;
      for (const Observation& o : scene_.tracks[static_cast<std::size_t>(t)].observations)
        if (o.used && o.view != v) ++shared[o.view];
    }
    std::vector<std::pair<int, int>> most_shared;
    for (const auto& [view, count] : shared) most_shared.emplace_back(-count, view);
    std::sort(most_shared.begin(), most_shared.end());
    BundleOptions bundle;
    bundle.lens = LensFreedom::fixed;
    bundle.free_views = {v};
    // The two views that fix the scale of the model stay where they are while there are few others.
    const std::size_t neighbours =
        std::min<std::size_t>(most_shared.size() / 2, static_cast<std::size_t>(options_.local_views - 1));
    for (std::size_t i = 0; i < neighbours; ++i) bundle.free_views.push_back(most_shared[i].second);
    bundle.max_points_per_view = options_.max_points_per_view;
    bundle.max_iterations = 10;
    bundle.tolerance = 1e-3;
    adjust_bundle(scene_, bundle);
    filter_points(scene_, options_.triangulation);
    extend_points_of_view(scene_, v, options_.triangulation);
  }

  const Track& track_of(const View& view, int keypoint) const {
    return scene_.tracks[static_cast<std::size_t>(view.track_of[static_cast<std::size_t>(keypoint)])];
  }

  Scene& scene_;
  const std::vector<ViewPair>& pairs_;
  std::vector<std::vector<int>> pairs_of_view_;
  const ReconstructionOptions& options_;
  std::vector<int> refused_at_;  // size of the model when a view was last refused
};

// How well a model explains its keypoints: number of used ones, and their median error in pixels.
struct ModelFit {
  std::size_t keypoints = 0;
  double median_error = 0.0;
};

ModelFit fit_of(const Scene& scene) {
  std::vector<double> errors;
  for (const Track& track : scene.tracks) {
    if (!track.triangulated) continue;
    for (const Observation& o : track.observations)
      if (o.used) errors.push_back(reprojection_error(scene, o, track.point));
  }
  if (errors.empty()) return {};
  const std::size_t count = errors.size();
  return {count, median(std::move(errors))};
}

void set_focal(Scene& scene, double guess) {
  for (Camera& camera : scene.cameras) {
    const double f = guess * std::max(camera.width, camera.height);
    camera = Camera{camera.width, camera.height, f, f, 0.5 * camera.width, 0.5 * camera.height};
  }
}

bool is_plausible(const Scene& scene) {
  return std::all_of(scene.cameras.begin(), scene.cameras.end(), [](const Camera& c) {
    const double ratio = c.fx / std::max(c.width, c.height);
    return ratio > 0.3 && ratio < 8.0;
  });
}

// A model started from the best pair under a focal guess; nothing when none starts. guess 0: the lens is known.
struct Start {
  Scene scene;
  ModelFit fit;
};

std::optional<Start> start_with(double guess, const Scene& empty, const std::vector<ViewPair>& pairs,
                                const ReconstructionOptions& options) {
  Scene trial = empty;
  if (guess > 0) set_focal(trial, guess);
  update_normalised(trial, options.threads);
  for (const ViewPair& pair : rank_seed_pairs(trial, pairs, options.seed, options.threads)) {
    Scene grown = trial;
    if (!plant_seed(grown, pair, options.seed)) continue;
    Mapper mapper(grown, pairs, options);
    mapper.adjust_everything();
    mapper.grow(options.trial_views, [](int) {});
    if (grown.registered_count() < 3 || !is_plausible(grown)) continue;
    mapper.adjust_everything();
    const ModelFit fit = fit_of(grown);
    spdlog::debug("focal guess {:.2f}: {:.1f} px after {} views, {} keypoints explained, median {:.2f} px", guess,
                  grown.cameras.front().fx, grown.registered_count(), fit.keypoints, fit.median_error);
    return Start{std::move(grown), fit};
  }
  return std::nullopt;
}

// True when the pictures do not contradict the focal length that their EXIF claims: editing and cropping spoil it.
bool bears_out(const Start& start, double guess) {
  constexpr double most_change = 0.15;
  constexpr double most_error = 1.0;  // pixels, of the median keypoint
  const Camera& camera = start.scene.cameras.front();
  const double found = camera.fx / std::max(camera.width, camera.height);
  return std::abs(found / guess - 1) < most_change && start.fit.median_error < most_error;
}

// Starts a model with each focal guess, and keeps the one with the smallest errors among those that explain many
// keypoints: a wrong focal length bends the model and so costs accuracy before it costs keypoints.
std::optional<Scene> best_start(const Scene& empty, const std::vector<ViewPair>& pairs,
                                const ReconstructionOptions& options) {
  if (options.known_guess && !options.known_lens) {
    auto start = start_with(*options.known_guess, empty, pairs, options);
    if (start && bears_out(*start, *options.known_guess)) return std::move(start->scene);
    spdlog::warn("the pictures contradict the focal length in their EXIF data: it is not used");
  }
  std::vector<Start> starts;
  for (const double guess : options.known_lens ? std::vector<double>{0.0} : options.focal_guesses)
    if (auto start = start_with(guess, empty, pairs, options)) starts.push_back(std::move(*start));
  std::size_t most = 0;
  for (const Start& start : starts) most = std::max(most, start.fit.keypoints);
  Start* best = nullptr;
  for (Start& start : starts) {
    if (start.fit.keypoints < 0.6 * static_cast<double>(most)) continue;
    if (best == nullptr || start.fit.median_error < best->fit.median_error) best = &start;
  }
  if (best == nullptr) return std::nullopt;
  return std::move(best->scene);
}

void remove_view(Scene& scene, int v) {
  scene.views[static_cast<std::size_t>(v)].registered = false;
  for (Track& track : scene.tracks)
    for (Observation& o : track.observations)
      if (o.view == v) o.used = false;
}

// Takes out views that contradict their pairs; returns how many.
int remove_inconsistent_views(Scene& scene, const std::vector<ViewPair>& pairs, const ReconstructionOptions& options) {
  const auto pairs_of_view = pairs_of_views(scene, pairs);
  std::vector<int> wrong;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].registered &&
        !agrees_with_pairs(scene, pairs, pairs_of_view[v], static_cast<int>(v), options.consistency))
      wrong.push_back(static_cast<int>(v));
  for (const int v : wrong) remove_view(scene, v);
  filter_points(scene, options.triangulation);
  return static_cast<int>(wrong.size());
}

}  // namespace

Result<ReconstructionSummary> reconstruct(Scene& scene, std::vector<ViewPair> pairs,
                                          const ReconstructionOptions& options, const Progress& progress) {
  const Error no_model{"the pictures do not fit together to one scene", "",
                       "walk slowly around a subject that stands still, with much overlap between pictures"};
  build_tracks(scene, pairs);
  progress(0.0, "starting a model");
  auto start = best_start(scene, pairs, options);
  if (!start) return tl::unexpected<Error>(no_model);
  scene = std::move(*start);
  // The model grows along the pairs whose rotations close the ring; the others are judged by the cameras it ends with.
  const std::size_t all_pairs = pairs.size();
  const std::vector<ViewPair> closing = pairs_that_close(scene, pairs, options.consistency, options.threads);
  spdlog::debug("{} of {} pairs contradict the averaged rotations", all_pairs - closing.size(), all_pairs);
  build_tracks(scene, closing);
  extend_points(scene, options.triangulation, options.threads);
  const int total = static_cast<int>(scene.views.size());
  const auto report = [&](int registered) {
    progress(0.1 + 0.6 * registered / total,
             "placing cameras, " + std::to_string(registered) + " of " + std::to_string(total));
  };
  {
    Mapper mapper(scene, closing, options);
    mapper.grow(total, report);
    mapper.adjust_everything();
  }

  for (int round = 0; round < 2; ++round) {
    progress(0.75 + 0.1 * round, "checking the cameras against each other");
    const int removed = remove_inconsistent_views(scene, round == 0 ? closing : pairs, options);
    pairs = consistent_pairs(scene, pairs, options.consistency, options.threads);
    build_tracks(scene, pairs);
    extend_points(scene, options.triangulation, options.threads);
    Mapper mapper(scene, pairs, options);
    mapper.adjust_everything();
    mapper.grow(total, report);
    spdlog::debug("round {}: {} views removed, {} of {} pairs kept, {} registered, {:.3f} px", round, removed,
                  pairs.size(), all_pairs, scene.registered_count(), mean_reprojection_error(scene));
  }
  progress(0.9, "adjusting all cameras and points");
  for (int round = 0; round < 2; ++round) {
    BundleOptions bundle;
    bundle.lens = Mapper(scene, pairs, options).lens_freedom();
    bundle.min_observations = 3;
    adjust_bundle(scene, bundle);
    update_normalised(scene, options.threads);
    // Points of two views took no part: find them anew from the moved cameras.
    for (Track& track : scene.tracks)
      if (track.triangulated && track.used_count() < bundle.min_observations)
        triangulate(scene, track, options.triangulation);
    extend_points(scene, options.triangulation, options.threads);
    filter_points(scene, options.triangulation);
  }
  ReconstructionSummary summary;
  summary.registered = scene.registered_count();
  summary.removed_pairs = static_cast<int>(all_pairs - pairs.size());
  summary.rms_error = mean_reprojection_error(scene);
  if (summary.registered < 3) return tl::unexpected<Error>(no_model);
  return summary;
}

}  // namespace gyre
