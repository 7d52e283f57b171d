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
struct Candidate {
  int track = 0;
  int reference = 0;
  std::size_t seen_by = 0;
  Eigen::Vector2d place;
};

std::vector<Candidate> candidates(const Scene& scene, std::span<const int> tracks, int view, const Pose& cam_from_world,
                                  const PatchPictures& pictures, const PatchAlignmentOptions& options) {
  const View& own = scene.views[view];
  const Camera camera = scene.camera_of(own).scaled(pictures.scale);
  const Eigen::Vector3d centre = centre_of(cam_from_world);
  const double margin = options.half_side + options.reach + 1;
  std::map<std::pair<int, int>, std::vector<Candidate>> cells;
  for (const int t : tracks) {
    const Track& track = scene.tracks[t];
    if (!track.triangulated) continue;
    const auto place = camera.project(cam_from_world * track.point);
    if (!place || place->x() < margin || place->y() < margin || place->x() >= camera.width - margin ||
        place->y() >= camera.height - margin)
      continue;
    const Eigen::Vector3d ray = (track.point - centre).normalized();
    Candidate candidate{t, -1, 0, *place};
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
  std::vector<Candidate> chosen;
  for (auto& [cell, found] : cells) {
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& a, const Candidate& b) { return a.seen_by > b.seen_by; });
    found.resize(std::min(found.size(), static_cast<std::size_t>(options.points_per_cell)));
    chosen.insert(chosen.end(), found.begin(), found.end());
  }
  return chosen;
}

// The affine map from pixels around `place` in the view's picture to the reference's, for a plane through the point
// that faces the middle between both cameras.
std::optional<Eigen::Matrix<double, 2, 3>> reference_from_view(const Scene& scene, const View& view,
                                                               const Pose& cam_from_world, const View& reference,
                                                               const Eigen::Vector3d& point,
                                                               const Eigen::Vector2d& place, double scale) {
  const Camera camera = scene.camera_of(view).scaled(scale);
  const Camera reference_camera = scene.camera_of(reference).scaled(scale);
  const Eigen::Vector3d eye = centre_of(cam_from_world);
  const Eigen::Vector3d normal = (0.5 * (eye + centre_of(reference.cam_from_world)) - point).normalized();
  std::array<Eigen::Vector2d, 3> mapped;
  constexpr double step = 8.0;  // pixels
  const std::array<Eigen::Vector2d, 3> from{place, place + Eigen::Vector2d(step, 0), place + Eigen::Vector2d(0, step)};
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d ray =
        cam_from_world.rotation.conjugate() * camera.normalised_from_pixel(from[i]).homogeneous();
    const double along = normal.dot(ray);
    if (along > -0.1 * ray.norm()) return std::nullopt;
    const Eigen::Vector3d on_plane = eye + normal.dot(point - eye) / along * ray;
    const auto pixel = reference_camera.project(reference.cam_from_world * on_plane);
    if (!pixel) return std::nullopt;
    mapped[i] = *pixel;
  }
  Eigen::Matrix<double, 2, 3> map;
  map.col(0) = (mapped[1] - mapped[0]) / step;
  map.col(1) = (mapped[2] - mapped[0]) / step;
  map.col(2) = mapped[0];
  return map;
}

// Offset of a parabola's top through three samples at -1, 0, 1.
double top_of(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

}  // namespace

PatchPictures prepare_patch_pictures(const cv::Mat& picture, const std::map<int, cv::Mat>& references, double scale,
                                     double smoothing) {
  const auto prepare = [&](const cv::Mat& given) {
    cv::Mat prepared;
    const Camera size = Camera{given.cols, given.rows}.scaled(scale);
    cv::resize(given, prepared, {size.width, size.height}, 0, 0, cv::INTER_AREA);
    cv::GaussianBlur(prepared, prepared, {}, smoothing);
    return prepared;
  };
  PatchPictures pictures{scale, prepare(picture), {}};
  for (const auto& [i, reference] : references) pictures.references[i] = prepare(reference);
  return pictures;
}

std::vector<AlignedPoint> align_patches(const Scene& scene, std::span<const int> tracks, int view,
                                        const Pose& cam_from_world, const PatchPictures& pictures,
                                        const PatchAlignmentOptions& options) {
  const View& own = scene.views[view];
  const Camera& camera = scene.camera_of(own);
  const Camera resized = camera.scaled(pictures.scale);
  const Eigen::Vector2d full_from_resized(static_cast<double>(camera.width) / resized.width,
                                          static_cast<double>(camera.height) / resized.height);
  const int half = options.half_side, reach = options.reach;
  std::vector<AlignedPoint> aligned;
  cv::Mat patch, correlation;
  for (const Candidate& c : candidates(scene, tracks, view, cam_from_world, pictures, options)) {
    const auto map = reference_from_view(scene, own, cam_from_world, scene.views[c.reference],
                                         scene.tracks[c.track].point, c.place, pictures.scale);
    if (!map) continue;
    // The window's centre lies in the middle of a pixel; OpenCV counts from the centre of the first one.
    const cv::Point middle(static_cast<int>(c.place.x()), static_cast<int>(c.place.y()));
    const Eigen::Vector2d corner(middle.x - half + 0.5, middle.y - half + 0.5);
    const Eigen::Vector2d origin = map->leftCols<2>() * (corner - c.place) + map->col(2) - Eigen::Vector2d(0.5, 0.5);
    const cv::Matx23d source((*map)(0, 0), (*map)(0, 1), origin.x(), (*map)(1, 0), (*map)(1, 1), origin.y());
    const cv::Size side(2 * half + 1, 2 * half + 1);
    cv::warpAffine(pictures.references.at(c.reference), patch, source, side, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
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
    aligned.push_back({c.track, (c.place + shift).cwiseProduct(full_from_resized)});
  }
  return aligned;
}

}  // namespace gyre
