// SPDX-License-Identifier: Apache-2.0
// From the arbitrary frame of a reconstruction to the world: up, floor, axis through the subject, metres.
#pragma once

#include "common/geometry/pose.h"
#include "common/result/result.h"
#include "offload/cameras/placed_board.h"
#include "offload/cameras/scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace gyre {

// Direction against gravity: orthogonal to the x axes of all cameras, which a photographer holds level, whatever their
// pitch; the smallest principal component of those axes, re-weighted against a few tilted ones. Cameras that all look
// the same way leave it to their mean -y. Unit length. Needs at least one pose.
Eigen::Vector3d up_direction(std::span<const Pose> cam_from_world);

// Point closest in least squares to all optical axes; nothing when they are parallel.
std::optional<Eigen::Vector3d> point_of_interest(std::span<const Pose> cam_from_world);

// Height of the lowest level at which many of the heights gather within `thickness` and hardly any lie below: a floor.
// Nothing when there is no such level.
std::optional<double> floor_level(std::vector<double> heights, double thickness);

// Highest level of the connected column of heights that begins at `bottom`; a gap larger than `max_gap` ends it unless
// `filled(from, to)` says that something is there, as dark clothes that show no points.
// uncertainty: how much the few highest differ, the share of a lonely outlier in the result.
struct ColumnTop {
  double height = 0.0;
  double uncertainty = 0.0;
};
std::optional<ColumnTop> column_top(
    std::vector<double> heights, double bottom, double max_gap,
    const std::function<bool(double, double)>& filled = [](double, double) { return false; });

// What is known of real lengths. The scale rests on the first of them that is there and makes the subject between 0.3
// and 2.6 metres tall: board, turntable, stature.
struct KnownLengths {
  double stature = 0.0;  // of the subject, metres
  bool stature_assumed = false;
  double turntable_radius = 0.0;  // from the axis to the camera, horizontally, metres; 0: not known
  std::optional<PlacedBoard> board;
};

enum class ScaleSource { board, turntable_radius, height, assumed_height };
// "board", "turntable-radius", "height", "assumed-height".
std::string_view name_of(ScaleSource source);

struct WorldFrame {
  Similarity world_from_model;
  Eigen::AlignedBox3d box;   // encloses the subject, world, metres
  double ring_radius = 0.0;  // median horizontal distance of the cameras from the axis, metres
  ScaleSource scale_source = ScaleSource::height;
  double scale_uncertainty = 0.0;   // standard deviation, as a share
  double height = 0.0;              // of the subject, metres: measured when board or turntable give the scale
  double height_uncertainty = 0.0;  // as a share
  bool has_floor = false;
};

// World of a reconstruction (the conventions of design.md section 5, the yaw left as it is): up from the cameras, then
// from the floor where one is seen, by its own points or by a board that lies at the subject's feet; the vertical axis
// through the point of interest. Where views are of a turn, both are those of the axis the subject turned about, and
// the feet are the floor, as the room's does not turn. The scale is as KnownLengths says, where the subject is what
// stands around the axis. The uncertainty of a stature's scale is that of the subject's ends (and for an assumed one,
// of people), of a turntable's the robust spread of the cameras' distances. Error when nothing stands there.
Result<WorldFrame> find_world(const Scene& scene, const KnownLengths& known);

// Moves poses and points of the scene.
void move_world(Scene& scene, const Similarity& new_from_old);

}  // namespace gyre
