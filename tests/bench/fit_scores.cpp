// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/fit_scores.h"

#include "common/geometry/pose.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"
#include "offload/report/surface_errors.h"
#include "tests/bench/mean_value_coordinates.h"
#include "tests/offload/body/eye_cover.h"
#include "tests/offload/fit/sample_cloud.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

namespace {

// What stands for the part of a surface seen from outside.
constexpr int points_of_a_surface = 40000, height_of_its_pictures = 600;

std::vector<double> distances_to(const ClosestPoint& surface, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& p : points)
    if (const auto found = surface.nearest(p)) distances.push_back(found->distance);
  return distances;
}

std::vector<Eigen::Vector3d> moved_points(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& motion) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(points.size());
  for (const Eigen::Vector3d& p : points) result.emplace_back(motion * p);
  return result;
}

// In front of and between the ears, chin to brow, by the true joints: the head joint at the top of the neck and the
// face around 5 cm above it, in heights of a head.
bool on_face(const Eigen::Vector3d& p, const Eigen::Vector3d& head) {
  const Eigen::Vector3d d = p - head;
  return std::abs(d.x()) < 0.065 && d.y() > -0.05 && d.y() < 0.09 && d.z() > 0.035;
}

Eigen::Vector3d middle_of(const TemplatePart& part, const std::vector<Eigen::Vector3d>& vertices) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int v = 0; v < part.vertex_count; ++v) sum += vertices[part.first_vertex + v];
  return sum / part.vertex_count;
}

constexpr std::array<double, 4> all_round = {0.3, 0.3 + 0.5 * std::numbers::pi, 0.3 + std::numbers::pi,
                                             0.3 + 1.5 * std::numbers::pi};

void write_sheet(const TriangleMesh& mesh, const Eigen::Vector3d& at, double distance, double above,
                 const std::array<double, 4>& azimuths, const std::filesystem::path& file) {
  const Camera camera = Camera::from_fov(600, 600, 0.5);
  cv::Mat sheet;
  for (const double angle : azimuths) {
    const Eigen::Vector3d eye = at + distance * Eigen::Vector3d(std::sin(angle), above, std::cos(angle)).normalized();
    const cv::Mat view = render(mesh, {}, camera, look_at(eye, at));
    if (sheet.empty()) {
      sheet = view;
    } else {
      cv::hconcat(sheet, view, sheet);
    }
  }
  cv::imwrite(file.string(), sheet);
}

}  // namespace

void print_figure(const std::string& name, const std::string& metric, double value, const std::string& unit) {
  const nlohmann::json line = {{"bench", "fit"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

void print_distances(const std::string& name, const std::string& metric, std::vector<double> metres) {
  if (metres.empty()) return;
  std::sort(metres.begin(), metres.end());
  const double sum = std::accumulate(metres.begin(), metres.end(), 0.0);
  print_figure(name, metric + "_mean", 1000 * sum / static_cast<double>(metres.size()), "mm");
  print_figure(name, metric + "_p95", 1000 * metres[metres.size() * 95 / 100], "mm");
}

Eigen::Isometry3d truth_from_fit(const BodyTemplate& body, const PersonFit& fit, const TriangleMesh& truth) {
  // The truth faces +Z.
  Similarity start;
  start.rotation = Eigen::AngleAxisd(-yaw_of(fit.pose), Eigen::Vector3d::UnitY());
  const auto floor_middle = [](const std::vector<Eigen::Vector3d>& points) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : points) box.extend(p);
    return Eigen::Vector3d(box.center().x(), box.min().y(), box.center().z());
  };
  TriangleMesh fitted;
  fitted.triangles = body.mesh.triangles;
  fitted.vertices = fit.vertices;
  std::vector<Eigen::Vector3d> turned;
  for (const Eigen::Vector3d& v : fit.vertices) turned.push_back(start * v);
  start.translation = floor_middle(truth.vertices) - floor_middle(turned);
  std::vector<int> outer;
  for (std::size_t v = 0; v < fit.vertices.size(); ++v)
    if (body.regions[v] != BodyRegion::inner) outer.push_back(static_cast<int>(v));
  const Similarity aligned = align_surfaces(truth, fitted, outer, start);
  return Eigen::Translation3d(aligned.translation) * aligned.rotation;
}

void print_scores(const std::string& name, const BodyTemplate& body, const PersonFit& fit, const Truth& truth,
                  const Eigen::Isometry3d& truth_from_world, double height) {
  const TruthPass& whole = truth.at("body");
  const TriangleMesh& head = truth.contains("head") ? truth.at("head").surface : whole.surface;
  const std::vector<Eigen::Vector3d> vertices = moved_points(fit.vertices, truth_from_world);
  const ClosestPoint fitted(vertices, body.mesh.triangles);
  print_distances(name, "true_to_fitted",
                  distances_to(fitted, visible_points(whole.surface.vertices, whole.surface.triangles,
                                                      points_of_a_surface, height_of_its_pictures)));
  print_distances(
      name, "fitted_to_true",
      distances_to(ClosestPoint(whole.surface),
                   visible_points(vertices, body.mesh.triangles, points_of_a_surface, height_of_its_pictures)));
  if (const auto joint = whole.joints.find("head"); joint != whole.joints.end()) {
    std::vector<Eigen::Vector3d> true_face, fitted_face;
    for (const Eigen::Vector3d& p :
         visible_points(head.vertices, head.triangles, points_of_a_surface, height_of_its_pictures))
      if (on_face(p, joint->second)) true_face.push_back(p);
    for (const Eigen::Vector3d& p :
         visible_points(vertices, body.mesh.triangles, points_of_a_surface, height_of_its_pictures))
      if (on_face(p, joint->second)) fitted_face.push_back(p);
    print_distances(name, "face_true_to_fitted", distances_to(fitted, true_face));
    print_distances(name, "face_fitted_to_true", distances_to(ClosestPoint(head), fitted_face));
  }

  const PosedBody coarse = evaluate(body, fit.state);
  const TemplatePart& skin = body.parts.front();
  std::vector<double> joint_errors, carried_errors;
  for (const auto& [joint, position] : whole.joints) {
    const int index = body.joint_index(joint);
    if (index < 0 || joint.ends_with("Eye")) continue;
    const Eigen::Vector3d error = truth_from_world * (fit.posed_from_rest[index] * fit.rest_joints[index]) - position;
    joint_errors.push_back(error.norm());
    print_figure(name, "joint_" + joint, 1000 * error.norm(), "mm");
    for (int k = 0; k < 3; ++k) print_figure(name, "joint_" + joint + "_" + "xyz"[k], 1000 * error[k], "mm");
    // The coarse fit's joint carried along by the fine fit, instead of regressed from its surface.
    const Eigen::VectorXd weights = mean_value_coordinates(
        {coarse.vertices.data(), static_cast<std::size_t>(skin.vertex_count)},
        {body.mesh.triangles.data(), static_cast<std::size_t>(skin.triangle_count)}, coarse.joint(index));
    Eigen::Vector3d carried = Eigen::Vector3d::Zero();
    for (int v = 0; v < skin.vertex_count; ++v) carried += weights[v] * vertices[v];
    carried_errors.push_back((carried - position).norm());
  }
  print_distances(name, "joints", joint_errors);
  print_distances(name, "joints_by_mean_values", carried_errors);
  for (const char* eye : {"leftEye", "rightEye"}) {
    const TemplatePart* part = body.part(eye);
    const auto found = whole.joints.find(eye);
    if (part == nullptr || found == whole.joints.end()) continue;
    print_figure(name, std::string(eye) + "_height_error", 1000 * (middle_of(*part, vertices) - found->second).y(),
                 "mm");
  }

  // Triangles that turned over against the body the surface started from.
  int folded = 0;
  for (const Eigen::Vector3i& t : body.mesh.triangles) {
    const auto normal = [&](const std::vector<Eigen::Vector3d>& x) -> Eigen::Vector3d {
      return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
    };
    folded += normal(fit.vertices).dot(normal(coarse.vertices)) < 0 ? 1 : 0;
  }
  print_figure(name, "eyeball_through_lids", 1000 * eyeballs_through_lids(body, body.mesh.vertices, fit.vertices),
               "mm");
  print_figure(name, "folded_triangles", folded, "1");
  print_figure(name, "residual_mean", 1000 * fit.quality.residual_mean, "mm");
  for (const auto& [measure, m] : fit.measures) {
    print_figure(name, measure, 1000 * m.value, "mm");
    print_figure(name, measure + "_deviation", 1000 * m.deviation, "mm");
  }
  if (height > 0) print_figure(name, "stature_error", 1000 * (fit.stature - height), "mm");
  for (const auto& [region, share] : fit.quality.support) print_figure(name, "support_" + region, share, "1");
  print_figure(name, "warnings", static_cast<double>(fit.warnings.size()), "1");
}

void write_views(const BodyTemplate& body, const PersonFit& fit, const Eigen::Isometry3d& truth_from_world,
                 const std::filesystem::path& folder, const std::string& name) {
  std::filesystem::create_directories(folder);
  TriangleMesh mesh;
  mesh.triangles = body.mesh.triangles;
  mesh.vertices = moved_points(fit.vertices, truth_from_world);
  const auto at = [&](const std::string& joint, const Eigen::Vector3d& fallback) -> Eigen::Vector3d {
    const int j = body.joint_index(joint);
    return j < 0 ? fallback : truth_from_world * (fit.posed_from_rest[j] * fit.rest_joints[j]);
  };
  write_sheet(mesh, {0, 0.85, 0}, 4.0, 0.05, all_round, folder / (name + "-body.png"));
  write_sheet(mesh, at("head", {0, 1.5, 0}) + Eigen::Vector3d(0, 0.04, 0), 0.75, 0.1, all_round,
              folder / (name + "-head.png"));
  const Eigen::Vector3d between_eyes = 0.5 * (at("leftEye", {0.03, 1.5, 0}) + at("rightEye", {-0.03, 1.5, 0}));
  write_sheet(mesh, between_eyes - Eigen::Vector3d(0, 0.035, 0), 0.28, 0.1, {-0.7, -0.25, 0.25, 0.7},
              folder / (name + "-face.png"));
  write_sheet(mesh, at("leftMiddleProximal", {0.4, 0.9, 0}), 0.5, 0.3, all_round, folder / (name + "-hand.png"));
  write_sheet(mesh, 0.5 * (at("leftFoot", {0, 0, 0}) + at("rightFoot", {0, 0, 0})), 1.0, 0.4, all_round,
              folder / (name + "-feet.png"));
  if (const auto written = write_ply(mesh, folder / (name + ".ply")); !written)
    spdlog::warn("{}", written.error().message());
}

}  // namespace gyre
