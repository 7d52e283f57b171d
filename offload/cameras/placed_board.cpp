// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/placed_board.h"

#include "common/board/board.h"
#include "common/geometry/quantile.h"
#include "offload/cameras/triangulation.h"

namespace gyre {

namespace {

constexpr double max_error = 2.0;  // pixels
constexpr int min_views = 3;       // two agree on anything along an epipolar line
constexpr std::size_t min_corners = 4;
constexpr double max_distortion = 0.02;         // of a corner's distances to the others, as a share
constexpr double sheet_tolerance = 0.25 / 150;  // a ruler beside the printed one is read to a quarter of a millimetre

struct PlacedCorner {
  Eigen::Vector3d on_board;  // metres
  Eigen::Vector3d in_scene;
  int corner = 0;
};

// A scene whose keypoints are the board's corners, one track a corner.
Scene scene_of_corners(const Scene& scene, const std::vector<std::vector<BoardCorner>>& seen) {
  Scene corners;
  corners.cameras = scene.cameras;
  corners.tracks.resize(board_corner_count);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& from = scene.views[v];
    View view;
    view.camera = from.camera;
    view.registered = from.registered;
    view.cam_from_world = from.cam_from_world;
    for (const BoardCorner& corner : seen[v]) {
      Track& track = corners.tracks[static_cast<std::size_t>(corner.corner)];
      track.observations.push_back({static_cast<int>(v), static_cast<int>(view.keypoints.size())});
      view.keypoints.push_back(corner.pixel);
    }
    corners.views.push_back(std::move(view));
  }
  update_normalised(corners, 1);
  return corners;
}

// Reconstructed by known distance.
double ratio(const PlacedCorner& a, const PlacedCorner& b) {
  return (a.in_scene - b.in_scene).norm() / (a.on_board - b.on_board).norm();
}

// Removes corners, the worst first, until the distances of every one agree with all others.
void remove_wrong(std::vector<PlacedCorner>& corners) {
  while (corners.size() >= min_corners) {
    std::vector<double> all;
    for (std::size_t i = 0; i < corners.size(); ++i)
      for (std::size_t j = i + 1; j < corners.size(); ++j) all.push_back(ratio(corners[i], corners[j]));
    const double common = median(all);
    std::vector<double> distortions;
    for (const PlacedCorner& corner : corners) {
      std::vector<double> own;
      for (const PlacedCorner& other : corners)
        if (other.corner != corner.corner) own.push_back(std::abs(ratio(corner, other) / common - 1));
      distortions.push_back(median(own));
    }
    const auto worst = std::max_element(distortions.begin(), distortions.end());
    if (*worst <= max_distortion) return;
    corners.erase(corners.begin() + (worst - distortions.begin()));
  }
}

}  // namespace

std::optional<PlacedBoard> place_board(const Scene& scene, const std::vector<std::vector<BoardCorner>>& seen) {
  Scene found = scene_of_corners(scene, seen);
  TriangulationOptions options;
  options.max_error = max_error;
  std::vector<PlacedCorner> corners;
  for (int i = 0; i < board_corner_count; ++i) {
    Track& track = found.tracks[static_cast<std::size_t>(i)];
    if (!triangulate(found, track, options) || track.used_count() < min_views) continue;
    const Eigen::Vector2d place = board_corner(i);
    corners.push_back({{place.x(), place.y(), 0}, track.point, i});
  }
  remove_wrong(corners);
  if (corners.size() < min_corners) return std::nullopt;

  std::vector<Eigen::Vector3d> on_board, in_scene;
  for (const PlacedCorner& corner : corners) {
    on_board.push_back(corner.on_board);
    in_scene.push_back(corner.in_scene);
  }
  const Result<Similarity> scene_from_board = align_points(in_scene, on_board);
  if (!scene_from_board) return std::nullopt;
  PlacedBoard board;
  board.corners = static_cast<int>(corners.size());
  board.scale = 1 / scene_from_board->scale;
  board.normal = scene_from_board->rotation * -Eigen::Vector3d::UnitZ();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    board.centre += in_scene[i] / static_cast<double>(corners.size());
    middle += on_board[i] / static_cast<double>(corners.size());
  }
  double residual = 0, spread = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    residual += (in_scene[i] - *scene_from_board * on_board[i]).squaredNorm();
    spread += (on_board[i] - middle).squaredNorm();
  }
  // Of 3n coordinates, seven are used up by the similarity.
  const double variance = residual / static_cast<double>(3 * corners.size() - 7);
  board.uncertainty = std::hypot(board.scale * std::sqrt(variance / spread), sheet_tolerance);

  std::set<int> views;
  for (const PlacedCorner& corner : corners)
    for (const Observation& o : found.tracks[static_cast<std::size_t>(corner.corner)].observations)
      if (o.used) views.insert(o.view);
  board.views = static_cast<int>(views.size());
  return board;
}

}  // namespace gyre
