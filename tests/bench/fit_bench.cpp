// SPDX-License-Identifier: Apache-2.0
// Measures the fit of the template to a cloud sampled from a true surface, as JSON lines.
//
//   fit_bench SUBJECT_DIR [--template FILE] [--cloud FILE] [--yaw-deg A] [--noise-mm S] [--out DIR]
//
// SUBJECT_DIR holds orbit-body with mesh.ply and joints.json. Without --cloud (a PLY in the world of the truth) the
// cloud is 150,000 points of the true surface that cameras around it see. Surface errors are those of the contract:
// true to fitted over the true surface, fitted to true over the fitted vertices that cameras around see.
#include "common/bundle/atomic_file.h"
#include "common/geometry/pose.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"
#include "offload/body/mean_value_coordinates.h"
#include "offload/fit/person_fit.h"
#include "tests/offload/fit/sample_cloud.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

namespace {

using gyre::Result;
using nlohmann::json;

void print(const std::string& name, const std::string& metric, double value, const std::string& unit) {
  const json line = {{"bench", "fit"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
}

void print_distances(const std::string& name, const std::string& metric, std::vector<double> distances) {
  if (distances.empty()) return;
  std::sort(distances.begin(), distances.end());
  const double sum = std::accumulate(distances.begin(), distances.end(), 0.0);
  print(name, metric + "_mean", 1000 * sum / static_cast<double>(distances.size()), "mm");
  print(name, metric + "_p95", 1000 * distances[distances.size() * 95 / 100], "mm");
}

// Names of the true skeleton and of the template's.
const std::vector<std::pair<std::string, std::string>> joint_names = {{"Hips", "hips"},
                                                                      {"Neck", "neck"},
                                                                      {"Head", "head"},
                                                                      {"LeftArm", "leftUpperArm"},
                                                                      {"LeftForeArm", "leftLowerArm"},
                                                                      {"LeftHand", "leftHand"},
                                                                      {"LeftUpLeg", "leftUpperLeg"},
                                                                      {"LeftLeg", "leftLowerLeg"},
                                                                      {"LeftFoot", "leftFoot"},
                                                                      {"RightArm", "rightUpperArm"},
                                                                      {"RightForeArm", "rightLowerArm"},
                                                                      {"RightHand", "rightHand"},
                                                                      {"RightUpLeg", "rightUpperLeg"},
                                                                      {"RightLeg", "rightLowerLeg"},
                                                                      {"RightFoot", "rightFoot"}};

std::vector<double> distances_to(const gyre::ClosestPoint& surface, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& p : points)
    if (const auto found = surface.nearest(p)) distances.push_back(found->distance);
  return distances;
}

// Points that stand for the part of a surface seen from outside, without noise.
std::vector<Eigen::Vector3d> visible_points(const std::vector<Eigen::Vector3d>& vertices,
                                            const std::vector<Eigen::Vector3i>& triangles) {
  const gyre::PointCloud cloud = gyre::sample_visible(vertices, triangles, {40000, 0.0, 600, 7});
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud.points) points.push_back(p.cast<double>());
  return points;
}

void write_views(const gyre::TriangleMesh& mesh, const std::filesystem::path& folder, const std::string& name) {
  const gyre::Camera camera = gyre::Camera::from_fov(600, 900, 0.9);
  cv::Mat sheet;
  for (int i = 0; i < 4; ++i) {
    const double angle = 2 * std::numbers::pi * i / 4;
    const Eigen::Vector3d eye(2.2 * std::sin(angle), 1.1, 2.2 * std::cos(angle));
    const cv::Mat view = gyre::render(mesh, {}, camera, gyre::look_at(eye, {0, 0.85, 0}));
    if (sheet.empty()) {
      sheet = view;
    } else {
      cv::hconcat(sheet, view, sheet);
    }
  }
  cv::imwrite((folder / (name + ".png")).string(), sheet);
}

struct Arguments {
  std::filesystem::path subject, template_file, cloud, out;
  double yaw_deg = 0.0;
  double noise_mm = 2.0;
};

Result<void> measure(const Arguments& arguments) {
  const auto truth = gyre::read_ply(arguments.subject / "orbit-body" / "mesh.ply");
  if (!truth) return tl::unexpected(truth.error());
  const auto text = gyre::read_file(arguments.subject / "orbit-body" / "joints.json");
  if (!text) return tl::unexpected(text.error());
  const auto body = gyre::find_template(arguments.template_file);
  if (!body) return tl::unexpected(body.error());
  const double yaw = arguments.yaw_deg / 180.0 * std::numbers::pi;
  gyre::PointCloud cloud;
  if (arguments.cloud.empty()) {
    cloud = gyre::sample_visible(truth->vertices, truth->triangles, {150000, arguments.noise_mm / 1000, 600, 1});
  } else {
    auto given = gyre::read_cloud(arguments.cloud);
    if (!given) return tl::unexpected(given.error());
    cloud = std::move(*given);
  }

  std::map<std::string, double> seconds;
  auto last = std::chrono::steady_clock::now();
  std::string step = "preparing";
  const auto fit =
      gyre::fit_person(*body, gyre::moved(cloud, yaw, Eigen::Vector3d::Zero()), {}, [&](double, std::string_view what) {
        const auto now = std::chrono::steady_clock::now();
        seconds[step] += std::chrono::duration<double>(now - last).count();
        last = now;
        step = what;
      });
  if (!fit) return tl::unexpected(fit.error());

  const std::string name = arguments.subject.filename().string();
  for (const auto& [what, duration] : seconds) print(name, "seconds_" + what, duration, "s");
  // Back into the world of the truth.
  const Eigen::Matrix3d back = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3d& v : fit->vertices) vertices.emplace_back(back * v);
  print_distances(name, "true_to_fitted",
                  distances_to(gyre::ClosestPoint(vertices, body->mesh.triangles),
                               visible_points(truth->vertices, truth->triangles)));
  print_distances(name, "fitted_to_true",
                  distances_to(gyre::ClosestPoint(*truth), visible_points(vertices, body->mesh.triangles)));
  std::vector<double> joint_errors, carried_errors;
  const gyre::PosedBody coarse = evaluate(*body, fit->state);
  json table;
  const json joints = json::parse(*text);
  for (const json& joint : joints.at("joints")) {
    for (const auto& [true_name, own_name] : joint_names) {
      if (joint.at("name") != true_name) continue;
      const int index = body->joint_index(own_name);
      if (index < 0) continue;
      const auto& p = joint.at("position");
      const Eigen::Vector3d fitted = back * (fit->posed_from_rest[index] * fit->rest_joints[index]);
      const Eigen::Vector3d first = back * coarse.joint(index);
      table[own_name] = {
          {"true", p}, {"fitted", {fitted.x(), fitted.y(), fitted.z()}}, {"coarse", {first.x(), first.y(), first.z()}}};
      joint_errors.push_back((fitted - Eigen::Vector3d(p[0], p[1], p[2])).norm());
      print(name, "joint_" + own_name, 1000 * joint_errors.back(), "mm");
      // The coarse fit's joint carried along by the fine fit, instead of regressed from its surface.
      const gyre::TemplatePart& skin = body->parts.front();
      const Eigen::VectorXd weights = gyre::mean_value_coordinates(
          {coarse.vertices.data(), static_cast<std::size_t>(skin.vertex_count)},
          {body->mesh.triangles.data(), static_cast<std::size_t>(skin.triangle_count)}, coarse.joint(index));
      Eigen::Vector3d carried = Eigen::Vector3d::Zero();
      for (int v = 0; v < skin.vertex_count; ++v) carried += weights[v] * vertices[v];
      carried_errors.push_back((carried - Eigen::Vector3d(p[0], p[1], p[2])).norm());
    }
  }
  print_distances(name, "joints", joint_errors);
  print_distances(name, "joints_by_mean_values", carried_errors);
  const double facing = gyre::yaw_of(fit->pose) - yaw;
  print(name, "facing_error", std::atan2(std::sin(facing), std::cos(facing)) * 180 / std::numbers::pi, "deg");
  if (fit->guesses.size() > 1) print(name, "facing_margin", 1000 * (fit->guesses[1].cost - fit->guesses[0].cost), "mm");
  for (const gyre::FacingGuess& guess : fit->guesses) {
    print(name, "guess_misfit", 1000 * guess.misfit, "mm");
    print(name, "guess_toes", guess.toes, "heights");
  }
  // Triangles that turned over against the coarse surface: folds and spikes.
  int folded = 0;
  for (const Eigen::Vector3i& t : body->mesh.triangles) {
    const auto normal = [&](const std::vector<Eigen::Vector3d>& x) -> Eigen::Vector3d {
      return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
    };
    folded += normal(fit->vertices).dot(normal(coarse.vertices)) < 0 ? 1 : 0;
  }
  print(name, "folded_triangles", folded, "1");
  print(name, "residual_mean", 1000 * fit->residual_mean, "mm");
  print(name, "stature", 1000 * fit->stature, "mm");
  print(name, "scale", fit->state.scale, "1");
  for (const auto& [region, share] : fit->support) print(name, "support_" + region, share, "1");
  for (const std::string& warning : fit->warnings) spdlog::warn("{}", warning);

  if (!arguments.out.empty()) {
    std::filesystem::create_directories(arguments.out);
    if (auto written = gyre::write_file(arguments.out / "joints.json", table.dump(1)); !written) return written;
    gyre::TriangleMesh mesh;
    mesh.triangles = body->mesh.triangles;
    mesh.vertices = vertices;
    write_views(mesh, arguments.out, "posed");
    if (auto written = gyre::write_ply(mesh, arguments.out / "posed.ply"); !written) return written;
    mesh.vertices = coarse.vertices;
    for (Eigen::Vector3d& v : mesh.vertices) v = back * v;
    write_views(mesh, arguments.out, "coarse");
    mesh.vertices = fit->rest_vertices;
    write_views(mesh, arguments.out, "rest");
    mesh = *truth;
    mesh.colours.clear();
    write_views(mesh, arguments.out, "truth");
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Measures the fit of the human template to a cloud of a true surface.");
  app.add_option("subject", arguments.subject, "folder of the subject, with orbit-body")->required();
  app.add_option("--template", arguments.template_file, "packed template; default: as the fit stage finds one");
  app.add_option("--cloud", arguments.cloud, "cloud to fit, in the world of the truth");
  app.add_option("--yaw-deg", arguments.yaw_deg, "turns the cloud first");
  app.add_option("--noise-mm", arguments.noise_mm, "of the sampled cloud");
  app.add_option("--out", arguments.out, "folder for the meshes and pictures of them");
  CLI11_PARSE(app, argc, argv);
  gyre::start_logging("fit_bench", "info");
  const auto measured = measure(arguments);
  if (!measured) {
    std::fprintf(stderr, "%s\n", measured.error().message().c_str());
    return measured.error().exit_code();
  }
  return 0;
}
