// SPDX-License-Identifier: Apache-2.0
#include "offload/body/face_model.h"

#include "common/bundle/atomic_file.h"
#include "offload/body/npz.h"

#include <nlohmann/json.hpp>

namespace gyre {
namespace {

constexpr float metres_per_face_unit = 0.01F;

// Polygons, as fans of triangles, whose corners all lie below `count`.
std::vector<Eigen::Vector3i> triangles_below(int count, const std::vector<std::int32_t>& start,
                                             const std::vector<std::int32_t>& corners) {
  std::vector<Eigen::Vector3i> triangles;
  for (std::size_t f = 0; f + 1 < start.size(); ++f) {
    const auto first = corners.begin() + start[f], last = corners.begin() + start[f + 1];
    if (!std::all_of(first, last, [&](int v) { return v < count; })) continue;
    for (auto c = first + 1; c + 1 < last; ++c) triangles.emplace_back(*first, *c, *(c + 1));
  }
  return triangles;
}

bool is_rising(const std::vector<std::int32_t>& start, std::size_t end) {
  return !start.empty() && start.front() >= 0 && std::is_sorted(start.begin(), start.end()) &&
         static_cast<std::size_t>(start.back()) <= end;
}

}  // namespace

Result<FaceModel> read_face_model(const std::filesystem::path& folder, int modes) {
  const std::filesystem::path file = folder / "ict_face_light.npz", index_file = folder / "ict_vertex_indices.json";
  const Result<NpzArrays> arrays = read_npz(file);
  if (!arrays) return tl::unexpected(arrays.error());
  for (const char* name : {"face_start", "face_v", "identity_q", "identity_vertex_count"})
    if (!arrays->integers.count(name)) return fail("archive without array '" + std::string(name) + "'", file.string());
  for (const char* name : {"neutral", "identity_scale"})
    if (!arrays->reals.count(name)) return fail("archive without array '" + std::string(name) + "'", file.string());
  const auto& neutral = arrays->reals.at("neutral");
  const auto& scale = arrays->reals.at("identity_scale");
  const auto& packed = arrays->integers.at("identity_q");
  const auto& start = arrays->integers.at("face_start");
  const auto& corners = arrays->integers.at("face_v");
  const int count = arrays->integers.at("identity_vertex_count")[0];
  const auto all = static_cast<int>(neutral.size() / 3);
  if (count < 3 || count > all || modes < 1 || scale.size() < static_cast<std::size_t>(modes) ||
      packed.size() < 3 * static_cast<std::size_t>(count) * static_cast<std::size_t>(modes) ||
      !is_rising(start, corners.size()) ||
      !std::all_of(corners.begin(), corners.end(), [&](int v) { return v >= 0 && v < all; }))
    return fail("arrays do not match each other", file.string());

  FaceModel model;
  for (int v = 0; v < count; ++v)
    model.mesh.vertices.push_back(metres_per_face_unit *
                                  Eigen::Map<const Eigen::Vector3f>(&neutral[3 * v]).cast<double>());
  model.mesh.triangles = triangles_below(count, start, corners);
  for (int k = 0; k < modes; ++k) {
    const auto* first = packed.data() + 3 * static_cast<std::size_t>(count) * static_cast<std::size_t>(k);
    model.modes.emplace_back(metres_per_face_unit * scale[k] *
                             Eigen::Map<const Eigen::Matrix3Xi>(first, 3, count).cast<float>());
  }

  const Result<std::string> text = read_file(index_file);
  if (!text) return tl::unexpected(text.error());
  const nlohmann::json indices = nlohmann::json::parse(*text, nullptr, false);
  const nlohmann::json points =
      indices.is_object() ? indices.value("idx_to_landmark_verts", nlohmann::json()) : indices;
  if (!points.is_array() || points.size() != model.landmarks.size())
    return fail("no list of 68 landmark vertices", index_file.string());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].is_number_unsigned() || points[i].get<std::uint64_t>() >= static_cast<std::uint64_t>(count))
      return fail("landmark vertex that is not there", index_file.string());
    model.landmarks[i] = points[i].get<int>();
  }
  return model;
}

}  // namespace gyre
