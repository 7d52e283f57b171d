// SPDX-License-Identifier: Apache-2.0
// Measures a bundle's work/cloud against the true surface, as JSON lines.
//
//   cloud_bench BUNDLE SUBJECT_DIR [CASE]    (SUBJECT_DIR holds orbit-body, orbit-head or turn with truth.json and
//   mesh.ply; CASE names the lines instead of it)
//
// The world of the bundle is moved onto the truth by the similarity that aligns the camera centres. Distances from the
// cloud are to the union of the true meshes of the passes; the true surface is sampled evenly, and a sample counts as
// visible when at least one keyframe sees it.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/log/log.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_io.h"
#include "tests/bench/true_pose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>

namespace {

using gyre::Result;
using nlohmann::json;

void print(const std::string& name, const std::string& metric, double value, const std::string& unit) {
  const json line = {{"bench", "cloud"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
}

std::string capture_of_pass(const std::string& pass) {
  return pass == "turn" ? "turn" : "orbit-" + pass;
}

// Keyframes with their true poses, the alignment, and what the passes' truth says of the surface.
struct Truth {
  std::vector<std::pair<gyre::Camera, gyre::Pose>> views;
  gyre::Similarity truth_from_bundle;
  gyre::TriangleMesh surface;
};

Result<Truth> read_truth(const gyre::ColmapModel& model, const std::filesystem::path& subject) {
  Truth truth;
  std::map<std::string, json> passes;
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> exact;
  for (const auto& [id, image] : model.images) {
    const auto frame = gyre::parse_frame_name(image.name);
    if (!frame) return gyre::fail("not a keyframe's name", image.name);
    const std::filesystem::path folder = subject / capture_of_pass(frame->pass);
    if (!passes.contains(frame->pass)) {
      const auto text = gyre::read_file(folder / "truth.json");
      if (!text) return tl::unexpected(text.error());
      passes[frame->pass] = json::parse(*text);
      const auto mesh = gyre::read_ply(folder / "mesh.ply");
      if (!mesh) return tl::unexpected(mesh.error());
      const auto offset = static_cast<int>(truth.surface.vertices.size());
      for (const auto& v : mesh->vertices) truth.surface.vertices.push_back(v);
      for (const auto& t : mesh->triangles) truth.surface.triangles.emplace_back(t.array() + offset);
    }
    const json& pass = passes[frame->pass];
    const auto camera = gyre::camera_from_json(pass.at("camera"));
    if (!camera) return tl::unexpected(camera.error());
    const gyre::Pose pose = gyre::bench::true_pose(pass.at("frames").at(frame->index));
    truth.views.emplace_back(*camera, pose);
    estimated.push_back(centre_of(image.cam_from_world));
    exact.push_back(centre_of(pose));
  }
  const auto aligned = gyre::align_points(exact, estimated);
  if (!aligned) return tl::unexpected(aligned.error());
  truth.truth_from_bundle = *aligned;
  return truth;
}

std::vector<Eigen::Vector3d> sample_surface(const gyre::TriangleMesh& mesh, std::size_t count) {
  std::vector<double> area{0.0};
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[1]] - mesh.vertices[t[0]];
    const Eigen::Vector3d b = mesh.vertices[t[2]] - mesh.vertices[t[0]];
    area.push_back(area.back() + 0.5 * a.cross(b).norm());
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Eigen::Vector3d> samples;
  while (samples.size() < count) {
    const auto it = std::upper_bound(area.begin() + 1, area.end() - 1, uniform(random) * area.back());
    const auto& t = mesh.triangles[static_cast<std::size_t>(it - area.begin() - 1)];
    double u = uniform(random);
    double v = uniform(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    samples.emplace_back(mesh.vertices[t[0]] + u * (mesh.vertices[t[1]] - mesh.vertices[t[0]]) +
                         v * (mesh.vertices[t[2]] - mesh.vertices[t[0]]));
  }
  return samples;
}

int views_that_see(const Eigen::Vector3d& x, const Truth& truth, const gyre::ClosestPoint& surface) {
  int count = 0;
  for (const auto& [camera, pose] : truth.views) {
    const auto pixel = camera.project(pose * x);
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > camera.width || pixel->y() > camera.height) continue;
    if (!surface.occluded(centre_of(pose), x, 1e-4)) ++count;
  }
  return count;
}

// Distance from each query to the nearest point of a cloud, by a sorted grid; `limit` when nothing is that near.
std::vector<double> distances_to_cloud(const std::vector<Eigen::Vector3d>& queries,
                                       const std::vector<Eigen::Vector3d>& points, double limit) {
  using Cell = std::array<int, 3>;
  const auto cell_of = [&](const Eigen::Vector3d& x) {
    return Cell{static_cast<int>(std::floor(x.x() / limit)), static_cast<int>(std::floor(x.y() / limit)),
                static_cast<int>(std::floor(x.z() / limit))};
  };
  std::map<Cell, std::vector<Eigen::Vector3d>> cells;
  for (const auto& x : points) cells[cell_of(x)].push_back(x);
  std::vector<double> distances;
  for (const auto& q : queries) {
    double best = limit;
    const Cell at = cell_of(q);
    for (int n = 0; n < 27; ++n) {
      const auto it = cells.find({at[0] + n / 9 - 1, at[1] + n / 3 % 3 - 1, at[2] + n % 3 - 1});
      if (it == cells.end()) continue;
      for (const auto& x : it->second) best = std::min(best, (x - q).norm());
    }
    distances.push_back(best);
  }
  return distances;
}

double share_within(const std::vector<double>& values, double limit) {
  const auto inside = std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
  return static_cast<double>(inside) / static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

// What the stage says of itself, and what its process used.
Result<void> print_usage(const std::string& name, const gyre::Bundle& bundle) {
  const auto text = gyre::read_file(bundle.work("cloud") / "stage.json");
  if (!text) return tl::unexpected(text.error());
  const json stage = json::parse(*text);
  const json& facts = stage.at("result");
  print(name, "keyframes", facts.at("views").get<double>(), "1");
  print(name, "keyframes_left_out", static_cast<double>(facts.at("views_left_out").size()), "1");
  print(name, "wall", stage.at("seconds").get<double>(), "s");
  print(name, "cpu", stage.at("cpu_seconds").get<double>(), "s");
  print(name, "peak_memory", stage.at("peak_memory_mib").get<double>(), "MiB");
  print(name, "depth", facts.at("depth_mpx").get<double>(), "Mpx");
  print(name, "depth_cpu", facts.at("depth_cpu_seconds").get<double>(), "s");
  print(name, "depth_per_cpu_second", facts.at("mpx_per_cpu_second").get<double>(), "Mpx/s");
  return {};
}

Result<void> measure(const gyre::Bundle& bundle, const std::filesystem::path& subject, const std::string& name) {
  const auto model = gyre::read_colmap_model(bundle.work("cameras"));
  if (!model) return tl::unexpected(model.error());
  const auto cloud = gyre::read_cloud(bundle.work("cloud") / "cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  const auto truth = read_truth(*model, subject);
  if (!truth) return tl::unexpected(truth.error());
  const gyre::ClosestPoint surface(truth->surface);

  std::vector<Eigen::Vector3d> points;
  std::vector<double> distances;
  std::vector<double> angles;
  double sum = 0;
  for (std::size_t i = 0; i < cloud->points.size(); ++i) {
    points.push_back(truth->truth_from_bundle * cloud->points[i].cast<double>());
    const auto hit = surface.nearest(points.back());
    if (!hit) continue;
    distances.push_back(1000 * hit->distance);
    sum += distances.back();
    const Eigen::Vector3d normal = truth->truth_from_bundle.rotation * cloud->normals[i].cast<double>();
    angles.push_back(std::acos(std::clamp(normal.dot(hit->normal), -1.0, 1.0)) * 180 / std::acos(-1.0));
  }
  if (distances.empty()) return gyre::fail("the cloud is empty", bundle.work("cloud").string());
  std::sort(distances.begin(), distances.end());
  std::sort(angles.begin(), angles.end());
  print(name, "points", static_cast<double>(points.size()), "1");
  print(name, "distance_mean", sum / static_cast<double>(distances.size()), "mm");
  print(name, "distance_median", distances[distances.size() / 2], "mm");
  print(name, "distance_p95", distances[distances.size() * 95 / 100], "mm");
  print(name, "outliers_beyond_20mm", 1.0 - share_within(distances, 20.0), "share");
  print(name, "normal_angle_median", angles[angles.size() / 2], "deg");

  std::vector<Eigen::Vector3d> seen_once;
  std::vector<Eigen::Vector3d> seen_thrice;
  for (const Eigen::Vector3d& x : sample_surface(truth->surface, 20000)) {
    const int count = views_that_see(x, *truth, surface);
    if (count >= 1) seen_once.push_back(x);
    if (count >= 3) seen_thrice.push_back(x);
  }
  const std::vector<double> once = distances_to_cloud(seen_once, points, 0.02);
  const std::vector<double> thrice = distances_to_cloud(seen_thrice, points, 0.02);
  print(name, "visible_within_5mm", share_within(once, 0.005), "share");
  print(name, "visible_within_10mm", share_within(once, 0.010), "share");
  print(name, "visible_to_3_within_5mm", share_within(thrice, 0.005), "share");

  const auto text = gyre::read_file(bundle.work("cloud") / "cloud.json");
  if (!text) return tl::unexpected(text.error());
  const double height = json::parse(*text).at("height_m").get<double>();
  print(name, "height", 1000 * height * truth->truth_from_bundle.scale, "mm");
  return print_usage(name, bundle);
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("cloud_bench", "warn");
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: cloud_bench BUNDLE SUBJECT_DIR [CASE]\n");
    return 2;
  }
  try {
    const std::filesystem::path subject = std::filesystem::path(argv[2]).lexically_normal();
    const std::string name = argc == 4 ? argv[3] : subject.filename().string();
    if (const auto done = measure(gyre::Bundle(argv[1]), subject, name); !done) {
      std::fprintf(stderr, "cloud_bench: %s\n", done.error().message().c_str());
      return done.error().exit_code();
    }
  } catch (const json::exception& e) {
    std::fprintf(stderr, "cloud_bench: a file is not as expected: %s\n", e.what());
    return 1;
  }
  return 0;
}
