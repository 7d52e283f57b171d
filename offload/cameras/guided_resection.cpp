// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/guided_resection.h"

#include "offload/cameras/resection.h"

#include <algorithm>
#include <optional>
#include <set>

namespace gyre {

namespace {

struct Neighbours {
  int before = -1, after = -1;  // views
};

// Nearest registered views before and after in the same pass.
Neighbours neighbours_of(const Scene& scene, int v) {
  const View& view = scene.views[v];
  Neighbours found;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& other = scene.views[i];
    if (!other.registered || other.pass != view.pass) continue;
    if (other.order < view.order && (found.before < 0 || other.order > scene.views[found.before].order))
      found.before = static_cast<int>(i);
    if (other.order > view.order && (found.after < 0 || other.order < scene.views[found.after].order))
      found.after = static_cast<int>(i);
  }
  return found;
}

Pose between(const Pose& a, const Pose& b, double t) {
  Pose pose;
  pose.rotation = a.rotation.slerp(t, b.rotation);
  pose.translation = -(pose.rotation * ((1 - t) * centre_of(a) + t * centre_of(b)));
  return pose;
}

// A point of the world and how it looked from views nearby.
struct Landmark {
  int track = 0;
  std::vector<const Descriptor*> looks;
};

std::vector<Landmark> landmarks_near(const Scene& scene, std::span<const Features> features, int v, int views_asked) {
  std::vector<int> asked;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    if (scene.views[i].registered && scene.views[i].pass == scene.views[v].pass) asked.push_back(static_cast<int>(i));
  const auto steps = [&](int i) { return std::abs(scene.views[i].order - scene.views[v].order); };
  std::stable_sort(asked.begin(), asked.end(), [&](int x, int y) { return steps(x) < steps(y); });
  asked.resize(std::min(asked.size(), static_cast<std::size_t>(views_asked)));

  std::map<int, Landmark> by_track;
  for (const int i : asked) {
    const View& view = scene.views[i];
    for (std::size_t d = 0; d < features[i].descriptors.size(); ++d) {
      const int track = view.track_of[features[i].keypoint_of[d]];
      if (track < 0 || !scene.tracks[track].triangulated) continue;
      by_track[track].looks.push_back(&features[i].descriptors[d]);
    }
  }
  std::vector<Landmark> landmarks;
  for (auto& [track, landmark] : by_track) {
    landmark.track = track;
    landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

std::int32_t dot(const Descriptor& a, const Descriptor& b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

double squared_distance(std::int32_t dot_product) {
  constexpr double norm2 = static_cast<double>(descriptor_norm) * descriptor_norm;
  return std::max(0.0, 2.0 - 2.0 * dot_product / norm2);
}

struct Sighting {
  int track = 0;
  int keypoint = 0;
  double squared = 0.0;  // distance of the descriptors
};

// The landmarks seen from `pose`, each with the keypoint within `radius` pixels that looks most like it.
std::vector<Sighting> find_landmarks(const Scene& scene, const Features& features, int v, const Pose& pose,
                                     std::span<const Landmark> landmarks, double radius,
                                     const GuidedResectionOptions& options) {
  const View& view = scene.views[v];
  const Camera& camera = scene.camera_of(view);
  // Keypoints in cells as wide as the radius: the nine around a place hold all that is in reach.
  const auto columns = static_cast<int>(std::ceil(camera.width / radius)) + 2;
  const auto rows = static_cast<int>(std::ceil(camera.height / radius)) + 2;
  const auto cell = [&](const Eigen::Vector2d& p) {
    const int x = std::clamp(static_cast<int>(p.x() / radius), 0, columns - 1);
    const int y = std::clamp(static_cast<int>(p.y() / radius), 0, rows - 1);
    return std::pair{x, y};
  };
  std::vector<std::vector<int>> descriptors_in(static_cast<std::size_t>(columns) * rows);
  for (std::size_t d = 0; d < features.descriptors.size(); ++d) {
    const auto [x, y] = cell(features.keypoints[features.keypoint_of[d]]);
    descriptors_in[static_cast<std::size_t>(y) * columns + x].push_back(static_cast<int>(d));
  }
  std::map<int, Sighting> by_keypoint;
  for (const Landmark& landmark : landmarks) {
    const auto place = camera.project(pose * scene.tracks[landmark.track].point);
    if (!place || place->x() < 0 || place->y() < 0 || place->x() >= camera.width || place->y() >= camera.height)
      continue;
    std::int32_t best = 0, second = 0;
    int keypoint = -1;
    const auto [x0, y0] = cell(*place);
    for (int y = std::max(0, y0 - 1); y <= std::min(rows - 1, y0 + 1); ++y) {
      for (int x = std::max(0, x0 - 1); x <= std::min(columns - 1, x0 + 1); ++x) {
        for (const int d : descriptors_in[static_cast<std::size_t>(y) * columns + x]) {
          const int k = features.keypoint_of[d];
          if ((features.keypoints[k] - *place).norm() > radius) continue;
          std::int32_t like = 0;
          for (const Descriptor* look : landmark.looks) like = std::max(like, dot(*look, features.descriptors[d]));
          if (like > best) {
            if (k != keypoint) second = best;
            best = like;
            keypoint = k;
          } else if (like > second && k != keypoint) {
            second = like;
          }
        }
      }
    }
    if (keypoint < 0) continue;
    const double squared = squared_distance(best);
    if (squared > options.max_distance * options.max_distance ||
        squared > options.max_ratio * options.max_ratio * squared_distance(second))
      continue;
    const auto [entry, is_new] = by_keypoint.try_emplace(keypoint, Sighting{landmark.track, keypoint, squared});
    if (!is_new && squared < entry->second.squared) entry->second = {landmark.track, keypoint, squared};
  }
  std::vector<Sighting> sightings;
  for (const auto& [keypoint, sighting] : by_keypoint) sightings.push_back(sighting);
  return sightings;
}

std::size_t occupied_cells(const View& view, const Camera& camera, std::span<const Sighting> sightings,
                           std::span<const int> inliers) {
  std::set<std::pair<int, int>> cells;
  for (const int i : inliers) {
    const Eigen::Vector2d& p = view.keypoints[sightings[i].keypoint];
    cells.emplace(static_cast<int>(12 * p.x() / camera.width), static_cast<int>(12 * p.y() / camera.height));
  }
  return cells.size();
}

bool place(Scene& scene, std::span<const Features> features, int v, const GuidedResectionOptions& options) {
  const auto [before, after] = neighbours_of(scene, v);
  if (before < 0 || after < 0) return false;
  View& view = scene.views[v];
  const View &first = scene.views[before], &last = scene.views[after];
  const int gap = last.order - first.order;
  if (gap > options.max_gap) return false;
  const Camera& camera = scene.camera_of(view);
  const Pose guess = between(first.cam_from_world, last.cam_from_world,
                             static_cast<double>(view.frame - first.frame) / (last.frame - first.frame));
  const double reach = (centre_of(first.cam_from_world) - centre_of(last.cam_from_world)).norm();
  const std::vector<Landmark> landmarks = landmarks_near(scene, features, v, options.views_asked);

  Pose pose = guess;
  std::vector<Sighting> inliers;
  double radius = options.radius * std::max(camera.width, camera.height);
  while (true) {
    const std::vector<Sighting> sightings = find_landmarks(scene, features[v], v, pose, landmarks, radius, options);
    std::vector<Eigen::Vector2d> image;
    std::vector<Eigen::Vector3d> world;
    for (const Sighting& s : sightings) {
      image.push_back(view.normalised[s.keypoint]);
      world.push_back(scene.tracks[s.track].point);
    }
    const auto found = resect(image, world, options.max_error / camera.fx, options.min_inliers);
    spdlog::debug("guided: view {} radius {:.0f} px: {} landmarks, {} sightings, {} inliers", v, radius,
                  landmarks.size(), sightings.size(), found ? found->inliers.size() : 0);
    if (!found || static_cast<int>(occupied_cells(view, camera, sightings, found->inliers)) < options.min_cells)
      return false;
    pose = found->cam_from_world;
    if ((centre_of(pose) - centre_of(guess)).norm() > options.max_stray * reach) return false;
    if (radius == options.last_radius) {
      for (const int i : found->inliers) inliers.push_back(sightings[i]);
      break;
    }
    radius = std::max(options.last_radius, 0.25 * radius);
  }
  view.cam_from_world = pose;
  view.registered = true;
  for (const Sighting& s : inliers) {
    Track& track = scene.tracks[s.track];
    const auto own = std::find_if(track.observations.begin(), track.observations.end(),
                                  [&](const Observation& o) { return o.view == v; });
    if (own != track.observations.end()) {
      own->used = own->keypoint == s.keypoint;
      continue;
    }
    if (view.track_of[s.keypoint] >= 0) continue;
    const Observation observation{v, s.keypoint, true};
    track.observations.insert(
        std::upper_bound(track.observations.begin(), track.observations.end(), observation,
                         [](const Observation& x, const Observation& y) { return x.view < y.view; }),
        observation);
    view.track_of[s.keypoint] = s.track;
  }
  return true;
}

}  // namespace

std::vector<int> place_between_neighbours(Scene& scene, std::span<const Features> features,
                                          const GuidedResectionOptions& options) {
  std::vector<int> placed;
  // A view that has found its place helps those beside it.
  for (bool again = true; again;) {
    again = false;
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      if (scene.views[v].registered || !place(scene, features, static_cast<int>(v), options)) continue;
      placed.push_back(static_cast<int>(v));
      again = true;
    }
  }
  return placed;
}

}  // namespace gyre
