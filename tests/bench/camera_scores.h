// SPDX-License-Identifier: Apache-2.0
// How far found cameras are from true ones, and the line a bench prints for a figure.
#pragma once

#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/result/result.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace gyre::bench {

struct TrueCameras {
  std::map<std::string, Pose> cam_from_world;  // by keyframe name
  std::optional<Camera> camera;
};

// `folder`: a subject's folder with orbit-body/ and orbit-head/ in it (truth.json, metres), or one of a COLMAP text
// model whose pictures, in the order of their names, are the keyframes of the bundle.
Result<TrueCameras> read_true_cameras(const std::filesystem::path& folder, const Bundle& bundle);

// After the least-squares similarity of the centres.
struct CameraScores {
  int compared = 0;
  int misplaced = 0;                                         // by more than 50 mm
  double centre_median = 0, centre_p95 = 0, centre_max = 0;  // metres
  double centre_median_of_radius = 0;                        // share of the distance from the middle of the ring
  double rotation_median = 0, rotation_p95 = 0;              // radians
  double scale = 1;                                          // true over found lengths
  double focal_error = 0;                                    // share; 0 when the truth names no camera
};
Result<CameraScores> score_cameras(const ColmapModel& found, const TrueCameras& truth);

// One JSON line.
void print_figure(const std::string& bench, const std::string& name, const std::string& metric, double value,
                  const std::string& unit);

// The scores as lines, in mm, degrees and percent.
void print_scores(const std::string& name, const CameraScores& scores);

}  // namespace gyre::bench
