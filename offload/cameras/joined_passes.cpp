// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/joined_passes.h"

#include "common/geometry/quantile.h"

#include <spdlog/spdlog.h>
#include <set>

namespace gyre {

namespace {

// Passes most of whose views are not registered, while others are.
std::vector<int> missing_passes(const Scene& scene, const JoinOptions& options) {
  std::map<int, std::pair<int, int>> counts;  // missing, all
  for (const View& view : scene.views) {
    auto& [missing, all] = counts[view.pass];
    missing += view.registered ? 0 : 1;
    ++all;
  }
  std::vector<int> passes;
  for (const auto& [pass, count] : counts)
    if (count.first >= options.min_views && count.first >= options.min_missing * count.second) passes.push_back(pass);
  return passes.size() < counts.size() ? passes : std::vector<int>();
}

// The views of a pass alone, with the lenses of the scene; the others are there but match nothing.
std::optional<Scene> model_of_pass(const Scene& scene, int pass, std::span<const ViewPair> pairs,
                                   ReconstructionOptions options) {
  Scene own = scene;
  own.tracks.clear();
  for (View& view : own.views) view.registered = false;
  std::vector<ViewPair> within;
  for (const ViewPair& pair : pairs)
    if (scene.views[static_cast<std::size_t>(pair.a)].pass == pass &&
        scene.views[static_cast<std::size_t>(pair.b)].pass == pass)
      within.push_back(pair);
  options.known_lens = true;
  if (!reconstruct(own, std::move(within), options, [](double, std::string_view) {})) return std::nullopt;
  return own;
}

std::vector<Eigen::Vector3d> points_of(const Scene& scene, const Similarity& moved,
                                       const std::function<bool(const Eigen::Vector3d&)>& wanted) {
  std::vector<Eigen::Vector3d> points;
  for (const Track& track : scene.tracks) {
    if (!track.triangulated || track.used_count() < 3) continue;
    const Eigen::Vector3d p = moved * track.point;
    if (wanted(p)) points.push_back(p);
  }
  return points;
}

// A pass's own model around what its cameras look at: that at the origin, +Y up, their median distance 1.
struct OwnFrame {
  Similarity own_from_model;
  int views = 0;
};

std::optional<OwnFrame> own_frame(const Scene& model) {
  std::vector<Pose> poses;
  for (const View& view : model.views)
    if (view.registered) poses.push_back(view.cam_from_world);
  const auto centre = poses.empty() ? std::nullopt : point_of_interest(poses);
  if (!centre) return std::nullopt;
  std::vector<double> distances;
  for (const Pose& pose : poses) distances.push_back((centre_of(pose) - *centre).norm());
  OwnFrame frame;
  frame.views = static_cast<int>(poses.size());
  frame.own_from_model.scale = 1.0 / median(std::move(distances));
  frame.own_from_model.rotation = Eigen::Quaterniond::FromTwoVectors(up_direction(poses), Eigen::Vector3d::UnitY());
  frame.own_from_model.translation = -frame.own_from_model.scale * (frame.own_from_model.rotation * *centre);
  return frame;
}

// Makes the model's views, tracks and points the scene's.
void take_over(Scene& scene, Scene model, int pass) {
  const auto first = static_cast<int>(scene.tracks.size());
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].pass != pass) continue;
    View& view = model.views[v];
    for (int& track : view.track_of)
      if (track >= 0) track += first;
    scene.views[v] = std::move(view);
  }
  // What was left of the pass in the scene's own tracks belongs to the views that had no camera or a worse one.
  for (Track& track : scene.tracks)
    std::erase_if(track.observations, [&](const Observation& o) { return scene.view_of(o).pass == pass; });
  scene.tracks.insert(scene.tracks.end(), std::make_move_iterator(model.tracks.begin()),
                      std::make_move_iterator(model.tracks.end()));
  for (std::size_t t = 0; t < scene.tracks.size(); ++t)
    if (scene.tracks[t].used_count() < 2) scene.tracks[t].triangulated = false;
}

std::optional<JoinedPass> join_pass(Scene& scene, int pass, std::span<const ViewPair> pairs, const WorldFrame& world,
                                    const ReconstructionOptions& reconstruction, const JoinOptions& options) {
  auto model = model_of_pass(scene, pass, pairs, reconstruction);
  if (!model) return std::nullopt;
  const auto in_pass =
      std::count_if(scene.views.begin(), scene.views.end(), [&](const View& view) { return view.pass == pass; });
  const auto frame = own_frame(*model);
  if (!frame || frame->views < options.min_views || frame->views < 0.5 * static_cast<double>(in_pass))
    return std::nullopt;

  const double height = world.height;
  const std::vector<Eigen::Vector3d> subject =
      points_of(scene, world.world_from_model, [&](const Eigen::Vector3d& p) { return world.box.contains(p); });
  const std::vector<Eigen::Vector3d> seen = points_of(
      *model, frame->own_from_model, [&](const Eigen::Vector3d& p) { return p.norm() < options.subject_share; });
  CloudAlignmentOptions alignment;
  alignment.least_scale = options.least_distance;
  alignment.largest_scale = options.largest_distance;
  alignment.depth = options.head_share * height;
  alignment.reach = options.reach_share * height;
  const auto aligned = align_clouds(subject, seen, alignment);
  if (!aligned || aligned->residual > options.largest_residual * height) return std::nullopt;
  const Similarity scene_from_model = world.world_from_model.inverse() * aligned->a_from_b * frame->own_from_model;
  move_world(*model, scene_from_model);
  take_over(scene, std::move(*model), pass);
  return JoinedPass{pass, frame->views, aligned->residual, aligned->overlap};
}

}  // namespace

std::vector<JoinedPass> join_passes(Scene& scene, std::span<const ViewPair> pairs, const KnownLengths& known,
                                    const ReconstructionOptions& reconstruction, const JoinOptions& options) {
  std::vector<JoinedPass> joined;
  std::vector<int> missing = missing_passes(scene, options);
  if (missing.empty()) return joined;
  // The subject's height and floor are those that the first pass shows: when another was found instead, start there.
  const int first = std::min_element(scene.views.begin(), scene.views.end(), [](const View& x, const View& y) {
                      return x.pass < y.pass;
                    })->pass;
  if (missing.front() == first) {
    auto model = model_of_pass(scene, first, pairs, reconstruction);
    if (!model || own_frame(*model).value_or(OwnFrame{}).views < options.min_views) return joined;
    scene = std::move(*model);
    missing = missing_passes(scene, options);
  }
  const Result<WorldFrame> world = find_world(scene, known);
  if (!world) return joined;
  for (const int pass : missing) {
    if (const auto done = join_pass(scene, pass, pairs, *world, reconstruction, options)) {
      joined.push_back(*done);
      spdlog::info("a pass without common features is joined by its shape: {} cameras, {:.1f} mm residual", done->views,
                   1000 * done->residual);
    } else {
      spdlog::warn("a pass has no features in common with the others, and its shape does not tell where it belongs");
    }
  }
  return joined;
}

}  // namespace gyre
