// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/patch_alignment.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace gyre {

namespace {

// A point to look for: where it should be, and the reference that sees it from the most similar direction.
struct PatchCandidate {
  int track = 0;
  int reference = 0;
  std::size_t seen_by = 0;
  Eigen::Vector2d place;
};

std::vector<PatchCandidate> candidates(const Scene& scene, std::span<const int> tracks, int view,
                                       const Pose& cam_from_world, const PatchPictures& pictures,
                                       const PatchAlignmentOptions& options) {
  const View& own = scene.views[view];
  const Camera camera = scene.camera_of(own).scaled(pictures.scale);
  const Eigen::Vector3d centre = centre_of(cam_from_world);
  const double margin = options.half_side + options.reach + 1;
  std::map<std::pair<int, int>, std::vector<PatchCandidate>> cells;
  for (const int t : tracks) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated) continue;
    const auto place = camera.project(cam_from_world * track.point);
    if (!place || place->x() < margin || place->y() < margin || place->x() >= camera.width - margin ||
        place->y() >= camera.height - margin)
      continue;
    const Eigen::Vector3d ray = (track.point - centre).normalized();
    PatchCandidate candidate{t, -1, 0, *place};
    double most_similar = std::cos(0.6);  // radians; beyond it a patch looks like another
    for (const Observation& o : track.observations) {
      if (!o.used || !pictures.references.contains(o.view)) continue;
      ++candidate.seen_by;
      const double cosine = ray.dot((track.point - centre_of(scene.view_of(o).cam_from_world)).normalized());
      if (cosine < most_similar) continue;
      most_similar = cosine;
      candidate.reference = o.view;
    }
    if (candidate.reference >= 0)
      cells[{static_cast<int>(12 * place->x() / camera.width), static_cast<int>(12 * place->y() / camera.height)}]
          .push_back(candidate);
  }
  std::vector<PatchCandidate> chosen;
  for (auto& [cell, found] : cells) {
    std::stable_sort(found.begin(), found.end(),
                     [](const PatchCandidate& a, const PatchCandidate& b) { return a.seen_by > b.seen_by; });
    found.resize(std::min(found.size(), static_cast<std::size_t>(options.points_per_cell)));
    chosen.insert(chosen.end(), found.begin(), found.end());
  }
  return chosen;
}

// The affine map from pixels around `place` in the picture of a camera to the reference's, for a plane through the
// point.
std::optional<Eigen::Matrix<double, 2, 3>> reference_from_view(const Camera& camera, const Pose& cam_from_world,
                                                               const Camera& reference_camera, const Pose& reference,
                                                               const Eigen::Vector3d& point,
                                                               const Eigen::Vector3d& normal,
                                                               const Eigen::Vector2d& place) {
  const Eigen::Vector3d eye = centre_of(cam_from_world);
  std::array<Eigen::Vector2d, 3> mapped;
  constexpr double step = 8.0;  // pixels
  const std::array<Eigen::Vector2d, 3> from{place, place + Eigen::Vector2d(step, 0), place + Eigen::Vector2d(0, step)};
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d ray =
        cam_from_world.rotation.conjugate() * camera.normalised_from_pixel(from[i]).homogeneous();
    const double along = normal.dot(ray);
    if (along > -0.1 * ray.norm()) return std::nullopt;
    const Eigen::Vector3d on_plane = eye + normal.dot(point - eye) / along * ray;
    const auto pixel = reference_camera.project(reference * on_plane);
    if (!pixel) return std::nullopt;
    mapped[i] = *pixel;
  }
  Eigen::Matrix<double, 2, 3> map;
  map.col(0) = (mapped[1] - mapped[0]) / step;
  map.col(1) = (mapped[2] - mapped[0]) / step;
  map.col(2) = mapped[0];
  return map;
}

// For OpenCV, which counts from the centre of the first pixel: the picture the map leads to from a window of pixels
// around `middle`.
cv::Matx23d window_source(const Eigen::Matrix<double, 2, 3>& map, const Eigen::Vector2d& place, cv::Point middle,
                          int half) {
  const Eigen::Vector2d corner(middle.x - half + 0.5, middle.y - half + 0.5);
  const Eigen::Vector2d origin = map.leftCols<2>() * (corner - place) + map.col(2) - Eigen::Vector2d(0.5, 0.5);
  return {map(0, 0), map(0, 1), origin.x(), map(1, 0), map(1, 1), origin.y()};
}

// The direction the surface at a candidate's point faces: the one of several for which the reference looks most like
// the two other references with the most similar views of it.
Eigen::Vector3d surface_normal(const Scene& scene, const PatchCandidate& c, const Pose& cam_from_world,
                               const PatchPictures& pictures, int half) {
  const Track& track = scene.tracks[c.track];
  const View& reference = scene.views[c.reference];
  const Eigen::Vector3d to_eye = (centre_of(reference.cam_from_world) - track.point).normalized();
  const Eigen::Vector3d facing =
      (0.5 * (centre_of(cam_from_world) + centre_of(reference.cam_from_world)) - track.point).normalized();
  std::vector<std::pair<double, int>> others;
  for (const Observation& o : track.observations)
    if (o.used && o.view != c.reference && pictures.references.contains(o.view))
      others.emplace_back(-to_eye.dot((centre_of(scene.view_of(o).cam_from_world) - track.point).normalized()), o.view);
  std::sort(others.begin(), others.end());
  others.resize(std::min<std::size_t>(others.size(), 2));
  const Camera camera = scene.camera_of(reference).scaled(pictures.scale);
  const auto place = camera.project(reference.cam_from_world * track.point);
  if (others.empty() || !place) return facing;
  const cv::Point middle(static_cast<int>(std::floor(place->x())), static_cast<int>(std::floor(place->y())));
  const cv::Size side(2 * half + 1, 2 * half + 1);
  const cv::Mat& picture = pictures.references.at(c.reference);
  const cv::Rect window(middle.x - half, middle.y - half, side.width, side.height);
  if ((window & cv::Rect({}, picture.size())) != window) return facing;

  const Eigen::Vector3d across = facing.unitOrthogonal(), along = facing.cross(across);
  Eigen::Vector3d best = facing;
  double highest = -1.0;
  cv::Mat patch, correlation;
  for (int i = 0; i < 17; ++i) {
    const double tilt = i == 0 ? 0.0 : i < 9 ? 0.35 : 0.7;  // radians
    const double azimuth = 2 * 3.14159265358979323846 * (i % 8) / 8;
    const Eigen::Vector3d normal =
        std::cos(tilt) * facing + std::sin(tilt) * (std::cos(azimuth) * across + std::sin(azimuth) * along);
    double sum = 0.0;
    for (const auto& [cosine, other] : others) {
      const View& seen = scene.views[other];
      const auto map =
          reference_from_view(camera, reference.cam_from_world, scene.camera_of(seen).scaled(pictures.scale),
                              seen.cam_from_world, track.point, normal, *place);
      if (!map) continue;
      cv::warpAffine(pictures.references.at(other), patch, window_source(*map, *place, middle, half), side,
                     cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
      cv::matchTemplate(picture(window), patch, correlation, cv::TM_CCOEFF_NORMED);
      sum += correlation.at<float>(0, 0);
    }
    if (sum > highest) {
      highest = sum;
      best = normal;
    }
  }
  return best;
}

// Offset of a parabola's top through three samples at -1, 0, 1.
double top_of(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

// The mean of the patches that `source` (pixels of the picture from pixels of the patch) cuts out along the smear.
void smeared_patch(const cv::Mat& picture, const cv::Matx23d& source, cv::Size side, const Eigen::Vector2d& smear,
                   cv::Mat& patch) {
  const int samples = 1 + static_cast<int>(std::ceil(smear.norm()));
  cv::Mat sharp, sum(side, CV_32F, cv::Scalar(0));
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d back = ((i + 0.5) / samples - 0.5) * smear;
    cv::Matx23d moved = source;
    for (int r = 0; r < 2; ++r) moved(r, 2) -= source(r, 0) * back.x() + source(r, 1) * back.y();
    cv::warpAffine(picture, sharp, moved, side, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
    cv::accumulate(sharp, sum);
  }
  sum.convertTo(patch, CV_8U, 1.0 / samples);
}

}  // namespace

Pose CameraMotion::pose_at(double t, const Pose& cam_from_world) const {
  Pose pose;
  const double angle = turn.norm();
  const Eigen::Quaterniond turned(angle > 0 ? Eigen::AngleAxisd(t * angle, turn / angle)
                                            : Eigen::AngleAxisd(0, Eigen::Vector3d::UnitX()));
  pose.rotation = turned * cam_from_world.rotation;
  pose.translation = -(pose.rotation * (centre_of(cam_from_world) + t * shift));
  return pose;
}

PatchPictures prepare_patch_pictures(const cv::Mat& picture, const std::map<int, cv::Mat>& references, double scale,
                                     double smoothing) {
  const auto prepare = [&](const cv::Mat& given) {
    cv::Mat prepared;
    const Camera size = Camera{given.cols, given.rows}.scaled(scale);
    cv::resize(given, prepared, {size.width, size.height}, 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(prepared, prepared, {}, smoothing);
    return prepared;
  };
  PatchPictures pictures{scale, prepare(picture), {}, {}};
  for (const auto& [i, reference] : references) pictures.references[i] = prepare(reference);
  return pictures;
}

std::vector<AlignedPoint> align_patches(const Scene& scene, std::span<const int> tracks, int view,
                                        const Pose& cam_from_world, const CameraMotion& motion, PatchPictures& pictures,
                                        const PatchAlignmentOptions& options) {
  const View& own = scene.views[view];
  auto& normals = pictures.normals;
  const Camera& camera = scene.camera_of(own);
  const Camera resized = camera.scaled(pictures.scale);
  const Eigen::Vector2d full_from_resized(static_cast<double>(camera.width) / resized.width,
                                          static_cast<double>(camera.height) / resized.height);
  const Pose begin = motion.pose_at(-0.5, cam_from_world), end = motion.pose_at(0.5, cam_from_world);

  const int half = options.half_side, reach = options.reach;
  std::vector<AlignedPoint> aligned;
  cv::Mat patch, correlation;
  for (const PatchCandidate& c : candidates(scene, tracks, view, cam_from_world, pictures, options)) {
    const Eigen::Vector3d& point = scene.tracks[c.track].point;
    auto normal = normals.find(c.track);
    if (normal == normals.end())
      normal = normals.emplace(c.track, surface_normal(scene, c, cam_from_world, pictures, half)).first;
    const View& reference = scene.views[c.reference];
    const auto map = reference_from_view(resized, cam_from_world, scene.camera_of(reference).scaled(pictures.scale),
                                         reference.cam_from_world, point, normal->second, c.place);
    if (!map) continue;
    const cv::Point middle(static_cast<int>(c.place.x()), static_cast<int>(c.place.y()));
    const cv::Matx23d source = window_source(*map, c.place, middle, half);
    const auto first = resized.project(begin * point);
    const auto last = resized.project(end * point);
    if (!first || !last) continue;
    const Eigen::Vector2d smear = *last - *first;
    if (!(smear.norm() < options.max_smear)) continue;
    const cv::Size side(2 * half + 1, 2 * half + 1);
    smeared_patch(pictures.references.at(c.reference), source, side, smear, patch);
    const cv::Rect window(middle.x - half - reach, middle.y - half - reach, 2 * (half + reach) + 1,
                          2 * (half + reach) + 1);
    cv::matchTemplate(pictures.picture(window), patch, correlation, cv::TM_CCOEFF_NORMED);
    double best = 0.0;
    cv::Point at;
    cv::minMaxLoc(correlation, nullptr, &best, nullptr, &at);
    // A maximum on the rim lies outside.
    if (!(best >= options.min_correlation) || at.x == 0 || at.y == 0 || at.x == 2 * reach || at.y == 2 * reach)
      continue;
    const auto value = [&](int dx, int dy) { return static_cast<double>(correlation.at<float>(at.y + dy, at.x + dx)); };
    const Eigen::Vector2d shift(at.x - reach + top_of(value(-1, 0), best, value(1, 0)),
                                at.y - reach + top_of(value(0, -1), best, value(0, 1)));
    aligned.push_back({c.track, (c.place + shift).cwiseProduct(full_from_resized), best});
  }
  return aligned;
}

}  // namespace gyre
