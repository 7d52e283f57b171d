// SPDX-License-Identifier: Apache-2.0
// Measures a bundle's work/landmarks against the true landmarks of synthetic A, as JSON lines.
//
//   landmarks_bench BUNDLE SUBJECT_DIR     (SUBJECT_DIR holds orbit-body, orbit-head with truth.json and mesh.ply)
//
// The world of the bundle is moved onto the truth by the similarity that aligns the camera centres.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_io.h"
#include "offload/body/landmark_set.h"
#include "offload/report/camera_errors.h"
#include "offload/report/truth.h"
#include "tests/bench/true_landmarks.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

namespace {

using gyre::Result;
using nlohmann::json;

void print(const std::string& metric, double value, const std::string& unit) {
  const json line = {
      {"bench", "landmarks"}, {"case", "synthetic-a"}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
}

Result<void> measure(const gyre::Bundle& bundle, const std::filesystem::path& subject) {
  const auto model = gyre::read_colmap_model(bundle.work("cameras"));
  if (!model) return tl::unexpected(model.error());
  const auto truth = gyre::read_truth(subject);
  if (!truth) return tl::unexpected(truth.error());
  const auto errors = gyre::camera_errors(*model, *truth);
  if (!errors) return tl::unexpected(errors.error());
  const auto set = gyre::read_landmarks(bundle.work("landmarks") / "landmarks.json");
  if (!set) return tl::unexpected(set.error());
  const auto mesh = gyre::read_ply(subject / "orbit-body" / "mesh_full.ply");
  if (!mesh) return tl::unexpected(mesh.error());

  const std::map<std::string, Eigen::Vector3d> exact = gyre::true_landmarks_of_synthetic_a(*mesh);
  std::vector<double> face;
  int sigma_counted = 0, within_three_sigma = 0;
  for (const auto& [name, place] : exact) {
    const gyre::PlacedLandmark* mark = set->find(name);
    if (mark == nullptr) {
      print("missing_" + name, 1, "1");
      continue;
    }
    const Eigen::Vector3d offset = errors->truth_from_model * mark->position - place;
    print("error_" + name, 1000 * offset.norm(), "mm");
    if (gyre::is_face_landmark(name)) face.push_back(offset.norm());
    ++sigma_counted;
    within_three_sigma += offset.dot(mark->covariance.ldlt().solve(offset)) < 9 ? 1 : 0;
  }
  if (!face.empty()) {
    print("face_landmarks", static_cast<double>(face.size()), "1");
    print("face_error_max", 1000 * *std::max_element(face.begin(), face.end()), "mm");
  }
  print("within_three_sigma", static_cast<double>(within_three_sigma) / std::max(sigma_counted, 1), "1");
  print("placed", static_cast<double>(set->placed.size()), "1");
  if (set->yaw) {
    const Eigen::Vector3d forward =
        errors->truth_from_model.rotation * Eigen::Vector3d(std::sin(*set->yaw), 0, std::cos(*set->yaw));
    print("facing_error", std::abs(std::atan2(forward.x(), forward.z())) * 180 / std::numbers::pi, "deg");
  }
  print("facing_decided", set->yaw ? 1 : 0, "1");
  if (const auto text = gyre::read_file(bundle.work("landmarks") / "stage.json")) {
    const json record = json::parse(*text, nullptr, false);
    print("seconds", record.value("seconds", 0.0), "s");
    print("cpu_seconds", record.value("cpu_seconds", 0.0), "s");
    print("peak_memory", record.value("peak_memory_mib", 0.0), "MiB");
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("landmarks_bench", "warn");
  if (argc != 3) {
    std::fprintf(stderr, "usage: landmarks_bench BUNDLE SUBJECT_DIR\n");
    return 2;
  }
  const auto measured = measure(gyre::Bundle(argv[1]), argv[2]);
  if (measured) return 0;
  std::fprintf(stderr, "%s\n", measured.error().message().c_str());
  return measured.error().exit_code();
}
