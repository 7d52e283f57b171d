// SPDX-License-Identifier: Apache-2.0
// Writes a synthetic capture in the layout of the recorded test captures (truth format `synth-capture-1`).
#pragma once

#include "common/result/result.h"
#include "tests/synthetic/capture.h"

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace gyre::synthetic {

enum class PictureFormat {
  video,   // video.mp4, MPEG-4
  images,  // frames/NNNNNN.jpg
};

struct WriteOptions {
  PictureFormat pictures = PictureFormat::video;
  int jpeg_quality = 95;
  int texture_size = 2048;  // pixels
  int threads = 0;          // 0: all cores
};

// What truth.json and joints.json hold.
nlohmann::json truth_json(const Capture& capture);
nlohmann::json joints_json(const Capture& capture);

// The subject as frame `index` shows it, in the world, with texture coordinates when the subject has them.
TriangleMesh subject_at(const Capture& capture, int index);

// Renders every frame and writes video or images, truth.json, joints.json, mesh.ply and mesh_full.ply (all triangles),
// mesh.obj and texture.png (the albedo, a cell for every pair of triangles) and masks/ of every 10th frame into
// `folder`.
Result<void> write_capture(const Capture& capture, const std::filesystem::path& folder,
                           const WriteOptions& options = {});

}  // namespace gyre::synthetic
