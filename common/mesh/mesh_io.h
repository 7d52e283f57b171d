// SPDX-License-Identifier: Apache-2.0
// PLY (ascii and binary little endian) and OBJ files of surfaces and clouds.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"

#include <filesystem>

namespace gyre {

// Reads vertices, faces (polygons are split as fans), normals and colours. Files are outside input: sizes and indices
// are checked and a bad file is an error that names the place.
Result<TriangleMesh> read_ply(const std::filesystem::path& file);

// Reads the vertices of a PLY with normals, colours and the scalars `confidence`, `std_dev` (PointCloud::deviation) and
// `view_count` (PointCloud::views) where present.
Result<PointCloud> read_cloud(const std::filesystem::path& file);

// Binary little endian; doubles are written as float.
Result<void> write_ply(const TriangleMesh& mesh, const std::filesystem::path& file);
Result<void> write_cloud(const PointCloud& cloud, const std::filesystem::path& file);

// Wavefront OBJ: v, vt, vn (ignored), f. Texture coordinates are turned to the top-left origin of TriangleMesh.
Result<TriangleMesh> read_obj(const std::filesystem::path& file);
Result<void> write_obj(const TriangleMesh& mesh, const std::filesystem::path& file);

}  // namespace gyre
