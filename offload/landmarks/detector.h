// SPDX-License-Identifier: Apache-2.0
// The one interface behind which landmarks are found: by geometry, by a network, or by a person's clicks.
#pragma once

#include "common/bundle/stage.h"
#include "common/geometry/colmap_model.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/body/landmark_set.h"
#include "offload/landmarks/facing.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// A keyframe with a known camera.
struct LandmarkView {
  std::string name;  // file name inside the bundle's frames/
  Camera camera;
  Pose cam_from_world;
  std::filesystem::path picture;

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& in_world) const {
    return camera.project(cam_from_world * in_world);
  }
  Eigen::Vector3d centre() const { return centre_of(cam_from_world); }
  // Unit direction in the world of the ray through a pixel.
  Eigen::Vector3d ray(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d xy = camera.normalised_from_pixel(pixel);
    return (cam_from_world.rotation.conjugate() * Eigen::Vector3d(xy.x(), xy.y(), 1)).normalized();
  }
};

// What detectors look at.
struct Subject {
  PointCloud cloud;
  std::vector<LandmarkView> views;
  Figure figure;
  BodyParts parts;
  Facing facing;
};

// A landmark seen in one picture.
struct PixelDetection {
  std::string name;
  int view = 0;  // index into Subject::views
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double deviation = 2.0;  // pixels, standard deviation
};

// What a detector found: points in space, points in pictures that are still to be placed, and what it looked for in
// vain.
struct Detections {
  std::vector<PlacedLandmark> placed;
  std::vector<PixelDetection> pixels;
  std::map<std::string, std::string> missing;
};

class LandmarkDetector {
 public:
  virtual ~LandmarkDetector() = default;
  virtual std::string source() const = 0;  // "geometric", "network", "picked"
  virtual Result<Detections> detect(const Subject& subject, const Progress& progress) = 0;
};

}  // namespace gyre
