// SPDX-License-Identifier: Apache-2.0
// Measures how a template's expressions go over to people of random shape, as JSON lines: contacts of lids and lips,
// what the template gives itself, and the time.
//
//   transfer_bench [--template FILE] [--people N] [--rest FILE] [--out DIR]
//
// --rest: rest.ply of a fit, of a person who exists.
#include "offload/body/expression_transfer.h"
#include "tests/offload/body/eye_cover.h"
#include "tests/offload/body/random_person.h"

#include "common/log/log.h"
#include "common/mesh/mesh_io.h"
#include "common/render/rasterise.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

namespace {

using Points = std::vector<Eigen::Vector3d>;

void print(const std::string& name, const std::string& metric, double value, const std::string& unit) {
  const nlohmann::json line = {
      {"bench", "transfer"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

const gyre::Morph* find(const std::vector<gyre::Morph>& morphs, const std::string& name) {
  for (const gyre::Morph& m : morphs)
    if (m.name == name) return &m;
  return nullptr;
}

Points look(const Points& rest, const std::vector<gyre::Morph>& expressions, const gyre::Morph& expression) {
  Points state = rest;
  gyre::add_morph(state, expression, 1.0);
  if (const gyre::Morph* base = find(expressions, gyre::ExpressionTransfer::base_of(expression.name)))
    gyre::add_morph(state, *base, 1.0);
  return state;
}

// A row of faces: at rest and in some expressions.
cv::Mat faces(const gyre::BodyTemplate& body, const Points& rest, const std::vector<gyre::Morph>& expressions) {
  const std::vector<std::vector<std::string>> shown = {{},
                                                       {"eyeBlinkLeft"},
                                                       {"jawOpen"},
                                                       {"mouthSmileLeft", "mouthSmileRight"},
                                                       {"mouthPucker"},
                                                       {"jawOpen", "tongueOut"},
                                                       {"jawOpen", "mouthClose"},
                                                       {"eyeLookOutLeft", "eyeLookInRight"}};
  gyre::TriangleMesh mesh;
  mesh.triangles = body.mesh.triangles;
  mesh.colours.assign(rest.size(), gyre::Rgb(214, 170, 150));
  for (const gyre::TemplatePart& part : body.parts) {
    const gyre::Rgb colour = part.name == "lashes"   ? gyre::Rgb(60, 40, 30)
                             : part.name == "tongue" ? gyre::Rgb(220, 90, 100)
                                                     : gyre::Rgb(245, 245, 240);
    if (part.name != "body") std::fill_n(mesh.colours.begin() + part.first_vertex, part.vertex_count, colour);
  }
  const Eigen::Vector3d nose = rest[body.landmarks.at("noseTip")];
  cv::Mat row;
  for (const auto& names : shown) {
    mesh.vertices = rest;
    for (const std::string& name : names)
      if (const gyre::Morph* m = find(expressions, name)) gyre::add_morph(mesh.vertices, *m, 1.0);
    const cv::Mat face = gyre::render(mesh, {}, gyre::Camera::from_fov(360, 440, 0.42),
                                      gyre::look_at(nose + Eigen::Vector3d(0.12, 0.02, 0.5), nose));
    if (row.empty()) {
      row = face;
    } else {
      cv::hconcat(row, face, row);
    }
  }
  return row;
}

void measure_self(const gyre::BodyTemplate& body) {
  const auto count = static_cast<Eigen::Index>(body.mesh.vertices.size());
  Eigen::MatrixXd given = Eigen::MatrixXd::Zero(count, 3 * static_cast<Eigen::Index>(body.expressions.size()));
  for (std::size_t e = 0; e < body.expressions.size(); ++e)
    for (std::size_t i = 0; i < body.expressions[e].vertices.size(); ++i)
      given.block<1, 3>(body.expressions[e].vertices[i], 3 * static_cast<Eigen::Index>(e)) =
          body.expressions[e].offsets[i].cast<double>().transpose();
  std::vector<bool> movable(body.mesh.vertices.size());
  for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = !given.row(static_cast<Eigen::Index>(v)).isZero(0);
  const auto start = std::chrono::steady_clock::now();
  const gyre::DeformationTransfer solver(body.mesh.vertices, body.mesh.vertices, body.mesh.triangles, movable);
  print("template", "seconds_factor", seconds_since(start), "s");
  const auto factored = std::chrono::steady_clock::now();
  const Eigen::MatrixXd moved = solver.transfer(given);
  print("template", "seconds_all_right_hand_sides", seconds_since(factored), "s");
  print("template", "self_residual", (moved - given).cwiseAbs().maxCoeff(), "m");
  print("template", "no_motion", solver.transfer(0.0 * given).cwiseAbs().maxCoeff(), "m");
}

void measure_person(const gyre::BodyTemplate& body, const std::string& name, const Points& rest, cv::Mat& sheet) {
  const auto start = std::chrono::steady_clock::now();
  const gyre::ExpressionTransfer transfer(body, rest);
  print(name, "seconds_prepare", seconds_since(start), "s");
  const auto prepared = std::chrono::steady_clock::now();
  const std::vector<gyre::Morph> expressions = transfer.transfer();
  print(name, "seconds_transfer", seconds_since(prepared), "s");
  const gyre::FaceContacts contacts(body, rest);
  double crossing = 0.0, penetration = 0.0, blink = 0.0, through = 0.0;
  std::string worst, worst_through;
  for (std::size_t e = 0; e < expressions.size(); ++e) {
    const Points state = look(rest, expressions, expressions[e]);
    const Points on_template = look(body.mesh.vertices, body.expressions, body.expressions[e]);
    if (const double out = gyre::eyeballs_through_lids(body, on_template, state); out > through) {
      through = out;
      worst_through = expressions[e].name;
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const gyre::ContactState found = contacts.measure(i, state, on_template);
      if (found.crossing > crossing) worst = expressions[e].name;
      crossing = std::max(crossing, found.crossing);
      penetration = std::max(penetration, found.penetration);
      const bool closed = (expressions[e].name == "eyeBlinkLeft" && contacts.opening(i).name == "leftEye") ||
                          (expressions[e].name == "eyeBlinkRight" && contacts.opening(i).name == "rightEye");
      if (closed) blink = std::max(blink, found.widest_gap);
    }
  }
  print(name, "crossing_worst", 1000 * crossing, "mm");
  print(name, "penetration_worst", 1000 * penetration, "mm");
  print(name, "eyeball_through_lids_worst", 1000 * through, "mm");
  print(name, "eyeball_through_lids_at_rest", 1000 * gyre::eyeballs_through_lids(body, body.mesh.vertices, rest), "mm");
  print(name, "blink_gap_widest", 1000 * blink, "mm");
  if (!worst.empty()) spdlog::info("{}: the worst crossing is in {}", name, worst);
  if (!worst_through.empty()) spdlog::info("{}: the eyeballs stand out furthest in {}", name, worst_through);
  sheet.push_back(faces(body, rest, expressions));
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::path file, out, rest;
  int people = 10;
  CLI::App app("Measures the transfer of a template's expressions to people of random shape.");
  app.add_option("--template", file, "packed template; default: as the stages find one");
  app.add_option("--people", people, "random people");
  app.add_option("--rest", rest, "rest surface of a fitted person, measured as well");
  app.add_option("--out", out, "folder for a picture of the faces");
  CLI11_PARSE(app, argc, argv);
  gyre::start_logging("transfer_bench", "info");
  const auto body = gyre::find_template(file);
  if (!body) {
    std::fprintf(stderr, "%s\n", body.error().message().c_str());
    return body.error().exit_code();
  }
  cv::Mat sheet;
  measure_self(*body);
  measure_person(*body, "template", body->mesh.vertices, sheet);
  for (int p = 0; p < people; ++p)
    measure_person(*body, "person-" + std::to_string(p), gyre::random_person(*body, static_cast<std::uint64_t>(p) + 1),
                   sheet);
  if (!rest.empty()) {
    const auto fitted = gyre::read_ply(rest);
    if (!fitted || fitted->vertices.size() != body->mesh.vertices.size()) {
      std::fprintf(stderr, "%s is no rest surface of this template\n", rest.c_str());
      return 1;
    }
    measure_person(*body, "fitted", fitted->vertices, sheet);
  }
  if (!out.empty()) {
    std::filesystem::create_directories(out);
    cv::imwrite((out / "faces.png").string(), sheet);
  }
  return 0;
}
