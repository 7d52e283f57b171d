// SPDX-License-Identifier: Apache-2.0
// Measures the fit of the template, as JSON lines: in a closed loop with the template's own people, on a cloud sampled
// from a rendered subject's true surface, and on the cloud of a reconstruction, whole and with parts missing.
//
//   fit_bench [SUBJECT_DIR] [--bundle DIR] [--seeds N] [--template FILE] [--noise-mm S] [--out DIR]
//
// SUBJECT_DIR holds the truth of a capture; --bundle its reconstruction up to the landmarks, or to the cloud.
#include "common/bundle/atomic_file.h"
#include "common/mesh/mesh_io.h"
#include "offload/fit/edge_laplacian.h"
#include "tests/bench/fit_scores.h"
#include "tests/offload/body/eye_cover.h"
#include "tests/offload/fit/random_person.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <numbers>

namespace {

using gyre::print_distances;
using gyre::print_figure;
using gyre::Result;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The fit with the seconds of each of its steps printed.
Result<gyre::PersonFit> timed_fit(const std::string& name, const gyre::BodyTemplate& body,
                                  const gyre::PointCloud& cloud, const gyre::LandmarkSet& landmarks) {
  std::map<std::string, double> seconds;
  const auto start = std::chrono::steady_clock::now();
  auto last = start;
  std::string step = "preparing";
  auto fit = gyre::fit_person(body, cloud, landmarks, {}, [&](double, std::string_view what) {
    seconds[step] += seconds_since(last);
    last = std::chrono::steady_clock::now();
    step = what;
  });
  const double all = seconds_since(start);
  print_figure(name, "seconds", all, "s");
  for (const auto& [what, duration] : seconds) print_figure(name, "share of " + what, duration / all, "1");
  return fit;
}

// People of the template come back.
Result<void> closed_loop(const gyre::BodyTemplate& body, int seeds, double noise) {
  std::vector<double> to_fitted, to_true, joints;
  double worst_surface = 0.0, worst_joints = 0.0, facing = 0.0, through = 0.0;
  int wrong_way = 0, swapped = 0;
  const auto mean = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  for (int seed = 0; seed < seeds; ++seed) {
    const gyre::RandomPerson person = gyre::random_person(body, seed);
    const auto clean = gyre::sample_visible(person.posed.vertices, body.mesh.triangles,
                                            {100000, noise, 600, static_cast<std::uint64_t>(seed)});
    const auto cloud = gyre::with_flaws(clean, person, body, {0.15, 0.01, static_cast<std::uint64_t>(seed)});
    const auto fit = gyre::fit_person(body, cloud);
    if (!fit) return tl::unexpected(fit.error());
    std::vector<Eigen::Vector3d> places;
    for (std::size_t j = 0; j < body.joints.size(); ++j)
      places.emplace_back(fit->posed_from_rest[j] * fit->rest_joints[j]);
    const auto errors = gyre::closed_loop_errors(body, person, fit->vertices, places, gyre::yaw_of(fit->pose));
    to_fitted.push_back(mean(errors.true_to_fitted));
    to_true.push_back(mean(errors.fitted_to_true));
    joints.push_back(mean(errors.joints));
    worst_surface = std::max({worst_surface, to_fitted.back(), to_true.back()});
    worst_joints = std::max(worst_joints, joints.back());
    facing = std::max(facing, errors.facing);
    through = std::max(through, gyre::eyeballs_through_lids(body, body.mesh.vertices, fit->vertices));
    wrong_way += errors.facing > 0.5 ? 1 : 0;
    swapped += errors.sides_swapped ? 1 : 0;
  }
  if (seeds == 0) return {};
  const std::string name = "closed loop";
  print_figure(name, "people", seeds, "1");
  print_figure(name, "true_to_fitted_mean", 1000 * mean(to_fitted), "mm");
  print_figure(name, "fitted_to_true_mean", 1000 * mean(to_true), "mm");
  print_figure(name, "surface_mean_worst_person", 1000 * worst_surface, "mm");
  print_figure(name, "joints_mean", 1000 * mean(joints), "mm");
  print_figure(name, "joints_mean_worst_person", 1000 * worst_joints, "mm");
  print_figure(name, "facing_error_worst", facing * 180 / std::numbers::pi, "deg");
  print_figure(name, "eyeball_through_lids_worst", 1000 * through, "mm");
  print_figure(name, "facing_wrong", wrong_way, "1");
  print_figure(name, "sides_swapped", swapped, "1");
  return {};
}

// One solve of the fine fit's system: with the factorisation of before, with new numbers, and from nothing.
void time_solves(const gyre::BodyTemplate& body) {
  const gyre::TemplatePart* part = body.part("body");
  if (part == nullptr) return;
  const std::vector<Eigen::Vector3d> x(body.mesh.vertices.begin(), body.mesh.vertices.begin() + part->vertex_count);
  const std::span<const Eigen::Vector3i> triangles(body.mesh.triangles.data(), part->triangle_count);
  const std::vector<double> weights(x.size(), 1.0 / static_cast<double>(x.size()));
  constexpr int rounds = 5;
  std::optional<gyre::EdgeLaplacian> energy;
  auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < rounds; ++i) {
    energy.emplace(x, triangles, 0.03);
    energy->factorise(weights, 0.1);
    energy->solve(x, x);
  }
  print_figure("solver", "fresh", 1000 * seconds_since(start) / rounds, "ms");
  start = std::chrono::steady_clock::now();
  for (int i = 0; i < rounds; ++i) {
    energy->factorise(weights, 0.1);
    energy->solve(x, x);
  }
  print_figure("solver", "kept_analysis", 1000 * seconds_since(start) / rounds, "ms");
  start = std::chrono::steady_clock::now();
  for (int i = 0; i < rounds; ++i) energy->solve(x, x);
  print_figure("solver", "kept_factorisation", 1000 * seconds_since(start) / rounds, "ms");
}

struct Arguments {
  std::filesystem::path subject, bundle, template_file, out;
  int seeds = 0;
  double noise_mm = 2.0;
};

Result<double> true_height(const std::filesystem::path& file) {
  const auto text = gyre::read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("subject_info")) return 0.0;
  return json["subject_info"].value("height_m", 0.0);
}

// The eyeballs' centres, which the truth of the frames does not have, as joints of the pass.
Result<void> add_eyes(const std::filesystem::path& file, gyre::TruthPass& pass) {
  const auto text = gyre::read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("joints")) return {};
  for (const auto& joint : json["joints"]) {
    const std::string name = joint.value("name", "");
    if (name != "LeftEye" && name != "RightEye") continue;
    const auto at = joint.at("position").get<std::array<double, 3>>();
    pass.joints[name == "LeftEye" ? "leftEye" : "rightEye"] = {at[0], at[1], at[2]};
  }
  return {};
}

Result<void> score(const std::string& name, const gyre::BodyTemplate& body, const gyre::PointCloud& cloud,
                   const gyre::LandmarkSet& landmarks, const gyre::Truth& truth, const Arguments& arguments) {
  const auto height = true_height(arguments.subject / "orbit-body" / "truth.json");
  if (!height) return tl::unexpected(height.error());
  const auto fit = timed_fit(name, body, cloud, landmarks);
  if (!fit) return tl::unexpected(fit.error());
  for (const std::string& warning : fit->warnings) spdlog::warn("{}: {}", name, warning);
  const Eigen::Isometry3d motion = gyre::truth_from_fit(body, *fit, truth.at("body").surface);
  gyre::print_scores(name, body, *fit, truth, motion, *height);
  if (!arguments.out.empty()) gyre::write_views(body, *fit, motion, arguments.out, name);
  return {};
}

// The reconstruction's cloud, and that cloud without what dark trousers, a moved arm or a missing head pass cost.
Result<void> score_bundle(const gyre::BodyTemplate& body, const gyre::Truth& truth, const Arguments& arguments) {
  const auto cloud = gyre::read_cloud(arguments.bundle / "work/cloud/cloud.ply");
  if (!cloud) return tl::unexpected(cloud.error());
  gyre::LandmarkSet landmarks;
  if (const auto file = arguments.bundle / "work/landmarks/landmarks.json"; std::filesystem::exists(file)) {
    auto read = gyre::read_landmarks(file);
    if (!read) return tl::unexpected(read.error());
    landmarks = std::move(*read);
  }
  if (auto done = score("reconstruction", body, *cloud, landmarks, truth, arguments); !done) return done;
  if (auto done = score("reconstruction without landmarks", body, *cloud, {}, truth, arguments); !done) return done;

  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : cloud->points) box.extend(p.cast<double>());
  const double height = box.max().y();
  const auto dark =
      gyre::only(*cloud, [&](const Eigen::Vector3d& p) { return p.y() < 0.07 * height || p.y() > 0.52 * height; });
  if (auto done = score("legs dark", body, dark, {}, truth, arguments); !done) return done;
  const double side = box.center().x() + 0.12 * height;
  const auto armless = gyre::only(*cloud, [&](const Eigen::Vector3d& p) { return p.x() < side; });
  if (auto done = score("arm missing", body, armless, {}, truth, arguments); !done) return done;
  // Without the head pass every fourth point of the head is left.
  std::size_t count = 0;
  const auto sparse =
      gyre::only(*cloud, [&](const Eigen::Vector3d& p) { return p.y() < 0.84 * height || ++count % 4 == 0; });
  return score("head sparse", body, sparse, {}, truth, arguments);
}

Result<void> measure(const Arguments& arguments) {
  const auto body = gyre::find_template(arguments.template_file);
  if (!body) return tl::unexpected(body.error());
  time_solves(*body);
  if (auto done = closed_loop(*body, arguments.seeds, arguments.noise_mm / 1000); !done) return done;
  if (arguments.subject.empty()) return {};
  auto truth = gyre::read_truth(arguments.subject);
  if (!truth) return tl::unexpected(truth.error());
  if (auto added = add_eyes(arguments.subject / "orbit-body" / "joints.json", truth->at("body")); !added) return added;
  const gyre::TriangleMesh& surface = truth->at("body").surface;
  const auto sampled =
      gyre::sample_visible(surface.vertices, surface.triangles, {150000, arguments.noise_mm / 1000, 600, 1});
  if (auto done = score("sampled", *body, sampled, {}, *truth, arguments); !done) return done;
  return arguments.bundle.empty() ? Result<void>{} : score_bundle(*body, *truth, arguments);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Measures the fit of the human template.");
  app.add_option("subject", arguments.subject, "folder of a subject with truth");
  app.add_option("--bundle", arguments.bundle, "reconstruction of that subject, up to the cloud or the landmarks");
  app.add_option("--seeds", arguments.seeds, "people of the closed loop");
  app.add_option("--template", arguments.template_file, "packed template; default: as the fit stage finds one");
  app.add_option("--noise-mm", arguments.noise_mm, "of the sampled clouds");
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
