// SPDX-License-Identifier: Apache-2.0
// A COLMAP sparse model in memory and as its three text files.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/result/result.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// A registered image. Ids are COLMAP's (from 1) and stable across a write and a read.
struct ModelImage {
  std::string name;  // file name inside the bundle's frames/
  int camera_id = 1;
  Pose cam_from_world;
  struct Observation {
    Eigen::Vector2d pixel;
    std::int64_t point_id = -1;  // -1: no 3D point
  };
  std::vector<Observation> observations;
};

struct ModelPoint {
  Eigen::Vector3d position;
  std::array<std::uint8_t, 3> rgb{};
  double error = 0.0;                      // mean reprojection error, pixels
  std::vector<std::pair<int, int>> track;  // image id, index into its observations
};

struct ColmapModel {
  std::map<int, Camera> cameras;
  std::map<int, ModelImage> images;
  std::map<std::int64_t, ModelPoint> points;

  // Camera of an image; the ids must be of this model.
  const Camera& camera_of(const ModelImage& image) const { return cameras.at(image.camera_id); }

  // Removes the images that show none of the points and returns how many those were: the cameras stage places pictures
  // too blurred for features by comparing them with others, and such pictures say little about surface and colour. A
  // model in which no image shows points stays whole.
  int remove_images_without_points();

  // Moves the world: x_new = new_from_old * x_old, for points and poses alike.
  void move_world(const Similarity& new_from_old);
};

// Writes cameras.txt, images.txt and points3D.txt into `folder` (which must exist). Cameras are written as PINHOLE,
// OPENCV (k3 = 0) or FULL_OPENCV, numbers with 17 significant digits and a decimal point in any locale.
Result<void> write_colmap_model(const ColmapModel& model, const std::filesystem::path& folder);

// Reads the text files. Camera types: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV (only with
// k4 = k5 = k6 = 0); another type is an error that names it.
Result<ColmapModel> read_colmap_model(const std::filesystem::path& folder);

}  // namespace gyre
