// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/patch_resection.h"

#include "common/log/log.h"
#include "offload/cameras/resection.h"

#include <algorithm>
#include <optional>

namespace gyre {

namespace {

// Registered views of the same pass, nearest in the walk first.
std::vector<int> placed_near(const Scene& scene, int v) {
  std::vector<int> near;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    if (scene.views[i].registered && scene.views[i].pass == scene.views[v].pass) near.push_back(static_cast<int>(i));
  const auto steps = [&](int i) { return std::abs(scene.views[i].order - scene.views[v].order); };
  std::stable_sort(near.begin(), near.end(), [&](int x, int y) { return steps(x) < steps(y); });
  return near;
}

// Sharp views to compare with: those nearest in the walk, and those whose cameras stand nearest to a pose and look its
// way, on whichever walk.
std::vector<int> references_for(const Scene& scene, const std::vector<int>& near, const Pose& pose,
                                const PatchResectionOptions& options) {
  std::vector<char> has_points(scene.views.size(), 0);
  for (const Track& track : scene.tracks)
    for (const Observation& o : track.observations)
      if (o.used) has_points[static_cast<std::size_t>(o.view)] = 1;
  std::vector<int> references;
  for (const int i : near)
    if (has_points[static_cast<std::size_t>(i)] != 0 &&
        static_cast<int>(references.size()) < options.references_in_walk)
      references.push_back(i);
  std::vector<std::pair<double, int>> beside;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (has_points[i] == 0 || std::find(references.begin(), references.end(), static_cast<int>(i)) != references.end())
      continue;
    if (angle_between(view.cam_from_world.rotation, pose.rotation) < options.max_angle)
      beside.emplace_back((centre_of(view.cam_from_world) - centre_of(pose)).norm(), static_cast<int>(i));
  }
  std::sort(beside.begin(), beside.end());
  beside.resize(std::min(beside.size(), static_cast<std::size_t>(options.references_beside)));
  for (const auto& [distance, i] : beside) references.push_back(i);
  return references;
}

Pose between(const Pose& a, const Pose& b, double t) {
  Pose pose;
  pose.rotation = a.rotation.slerp(t, b.rotation);
  pose.translation = -(pose.rotation * ((1 - t) * centre_of(a) + t * centre_of(b)));
  return pose;
}

// The tracks seen from the given views whose points move least between the pictures of the first two. When a camera
// walks around a subject, these are the subject's, while the room behind is smeared beyond recognition.
std::vector<int> calm_tracks(const Scene& scene, const std::vector<int>& seen_from, const View& first, const View& last,
                             double share) {
  std::vector<std::pair<double, int>> motions;
  for (std::size_t t = 0; t < scene.tracks.size(); ++t) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated || std::none_of(track.observations.begin(), track.observations.end(), [&](const auto& o) {
          return o.used && std::find(seen_from.begin(), seen_from.end(), o.view) != seen_from.end();
        }))
      continue;
    const auto from = scene.camera_of(first).project(first.cam_from_world * track.point);
    const auto to = scene.camera_of(last).project(last.cam_from_world * track.point);
    if (from && to) motions.emplace_back((*to - *from).norm(), static_cast<int>(t));
  }
  std::sort(motions.begin(), motions.end());
  motions.resize(static_cast<std::size_t>(std::ceil(share * static_cast<double>(motions.size()))));
  std::vector<int> tracks;
  tracks.reserve(motions.size());
  for (const auto& [motion, t] : motions) tracks.push_back(t);
  return tracks;
}

// A view to place and what it is compared with.
struct Comparison {
  int view = 0;
  std::map<double, PatchPictures> pictures;  // by scale
  std::vector<int> tracks;
};

// The picture of a view and those of its references, which are kept for the view after it.
class PictureCache {
 public:
  explicit PictureCache(const PictureOfView& picture_of) : picture_of_(picture_of) {}

  // At every scale of `options`; none when the view's picture or all references cannot be read.
  std::map<double, PatchPictures> prepared(int view, std::span<const int> references,
                                           const PatchResectionOptions& options) {
    std::map<int, cv::Mat> near;
    for (const int i : references) {
      const auto known = read_.find(i);
      if (cv::Mat picture = known != read_.end() ? known->second : picture_of_(i); !picture.empty())
        near.emplace(i, std::move(picture));
    }
    read_ = near;
    const cv::Mat own = picture_of_(view);
    std::map<double, PatchPictures> prepared;
    if (own.empty() || near.empty()) return prepared;
    for (const double scale : options.scales)
      if (!prepared.contains(scale))
        prepared.emplace(scale, prepare_patch_pictures(own, near, scale, options.smoothing));
    return prepared;
  }

 private:
  const PictureOfView& picture_of_;
  std::map<int, cv::Mat> read_;
};

struct PoseFit {
  Pose cam_from_world;
  std::size_t inliers = 0, patches = 0;
  double agreement = 0.0;  // sum of the inliers' correlations
};

// The pose by which most patches lie where they must, from one that is wrong by no more than the patches' reach.
std::optional<PoseFit> fit_at(const Scene& scene, Comparison& c, const Pose& guess, const CameraMotion& motion,
                              double scale, const PatchResectionOptions& options) {
  const Camera& camera = scene.camera_of(scene.views[c.view]);
  const std::vector<AlignedPoint> aligned =
      align_patches(scene, c.tracks, c.view, guess, motion, c.pictures.at(scale), options.patches);
  std::vector<Eigen::Vector2d> image;
  std::vector<Eigen::Vector3d> world;
  for (const AlignedPoint& a : aligned) {
    image.push_back(camera.normalised_from_pixel(a.pixel));
    world.push_back(scene.tracks[a.track].point);
  }
  const auto found = resect(image, world, options.max_error / scale / camera.fx, options.min_inliers);
  spdlog::debug("patch resection: view {} at {:.2f}: {} patches, {} agree", c.view, scale, aligned.size(),
                found ? found->inliers.size() : 0);
  if (!found) return std::nullopt;
  PoseFit fit{refine_pose(found->cam_from_world, image, world, options.usual_error / scale / camera.fx),
              found->inliers.size(), aligned.size()};
  for (const int i : found->inliers) fit.agreement += aligned[i].correlation;
  return fit;
}

// The motion that leads from one pose to another in the time of one exposure.
CameraMotion motion_between(const Pose& a, const Pose& b) {
  const Eigen::AngleAxisd turn(b.rotation * a.rotation.conjugate());
  return {centre_of(b) - centre_of(a), turn.angle() * turn.axis()};
}

// Tries which share of the way between the neighbours was walked during the exposure: the smear it makes of the
// patches is the one by which most of them are found.
PoseFit fit_exposure(const Scene& scene, Comparison& c, PoseFit fit, const CameraMotion& way,
                     const PatchResectionOptions& options) {
  std::vector<double> shares{0.0};
  for (double share = options.least_exposure; share < options.most_exposure; share *= std::sqrt(2.0))
    shares.push_back(share);
  for (int round = 0; round < options.exposure_rounds; ++round) {
    std::optional<PoseFit> best;
    double best_share = 0.0;
    for (const double share : shares) {
      const auto trial =
          fit_at(scene, c, fit.cam_from_world, {share * way.shift, share * way.turn}, options.scales.back(), options);
      if (!trial || (best && trial->agreement <= best->agreement)) continue;
      best = trial;
      best_share = share;
    }
    if (!best) break;
    fit = *best;
    spdlog::debug("patch resection: view {}: {:.3f} of the way during the exposure, {} of {} agree", c.view, best_share,
                  fit.inliers, fit.patches);
    shares = {best_share};
    if (best_share > 0)
      for (const double finer : {0.8, 0.9, 1.1, 1.25}) shares.push_back(finer * best_share);
  }
  return fit;
}

bool place(Scene& scene, int v, PictureCache& pictures, const PatchResectionOptions& options) {
  View& view = scene.views[v];
  std::vector<int> near = placed_near(scene, v);
  const auto before = std::find_if(near.begin(), near.end(), [&](int i) { return scene.views[i].order < view.order; });
  const auto after = std::find_if(near.begin(), near.end(), [&](int i) { return scene.views[i].order > view.order; });
  if (before == near.end() || after == near.end()) return false;
  const View &first = scene.views[*before], &last = scene.views[*after];
  if (last.order - first.order > options.max_gap) return false;

  near = references_for(scene, near, between(first.cam_from_world, last.cam_from_world, 0.5), options);
  Comparison comparison{v, pictures.prepared(v, near, options),
                        calm_tracks(scene, near, first, last, options.calm_share)};
  if (comparison.pictures.empty()) return false;

  std::optional<PoseFit> fit;
  for (int i = 1; i <= options.guesses; ++i) {
    const double t = static_cast<double>(i) / (options.guesses + 1);
    const Pose guess = between(first.cam_from_world, last.cam_from_world, t);
    const auto trial = fit_at(scene, comparison, guess, {}, options.scales.front(), options);
    if (trial && (!fit || trial->inliers > fit->inliers)) fit = trial;
  }
  for (std::size_t i = 1; fit && i < options.scales.size(); ++i)
    fit = fit_at(scene, comparison, fit->cam_from_world, {}, options.scales[i], options);
  if (fit) {
    // With the smear known, the room behind is recognised as well.
    comparison.tracks = calm_tracks(scene, near, first, last, 1.0);
    fit = fit_exposure(scene, comparison, *fit, motion_between(first.cam_from_world, last.cam_from_world), options);
  }
  if (!fit || static_cast<double>(fit->inliers) < options.min_inlier_share * static_cast<double>(fit->patches))
    return false;
  const Eigen::Vector3d centre = centre_of(fit->cam_from_world);
  const Eigen::Vector3d from = centre_of(first.cam_from_world), to = centre_of(last.cam_from_world);
  if (std::max((centre - from).norm(), (centre - to).norm()) > options.max_stray * (to - from).norm()) return false;
  view.cam_from_world = fit->cam_from_world;
  view.registered = true;
  return true;
}

}  // namespace

std::vector<int> place_between_neighbours(Scene& scene, const PictureOfView& picture_of,
                                          const PatchResectionOptions& options) {
  std::vector<int> placed;
  PictureCache pictures(picture_of);
  // From both ends of a gap inwards: patches change with the direction they are seen from, and a view that has found
  // its place helps the one beside it.
  for (bool again = true; again;) {
    std::vector<int> edge;
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      const View& view = scene.views[v];
      if (view.registered) continue;
      if (std::any_of(scene.views.begin(), scene.views.end(), [&](const View& other) {
            return other.registered && other.pass == view.pass && std::abs(other.order - view.order) == 1;
          }))
        edge.push_back(static_cast<int>(v));
    }
    again = false;
    for (const int v : edge) {
      if (!place(scene, v, pictures, options)) continue;
      placed.push_back(v);
      again = true;
    }
  }
  return placed;
}

}  // namespace gyre
