// SPDX-License-Identifier: Apache-2.0
// Measures the human template, as JSON lines: bodies of people it was not made from, joints, size, faults, speed.
//
//   body_bench SOURCES TEMPLATE
//
// TEMPLATE is built from SOURCES and written first. Held-out bodies are fitted to people of the survey that no template
// is made from, drawn with another seed.
#include "common/log/log.h"
#include "offload/body/body_evaluator.h"
#include "offload/body/shape_space.h"
#include "offload/body/template_build.h"
#include "offload/body/template_check.h"
#include "offload/body/template_parts.h"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

namespace {

using gyre::Result;
using nlohmann::json;

void print(const std::string& name, const std::string& metric, double value, const char* unit) {
  const json line = {{"bench", "body"}, {"case", name}, {"metric", metric}, {"value", value}, {"unit", unit}};
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A third of the area around each outer vertex of the body; zero elsewhere.
Eigen::VectorXd outer_areas(const gyre::BodyTemplate& body) {
  const auto& mesh = body.mesh;
  Eigen::VectorXd area = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(mesh.vertices.size()));
  for (int t = 0; t < body.parts[0].triangle_count; ++t) {
    const Eigen::Vector3i& c = mesh.triangles[t];
    const Eigen::Vector3d& a = mesh.vertices[c[0]];
    const double third = (mesh.vertices[c[1]] - a).cross(mesh.vertices[c[2]] - a).norm() / 6;
    for (int k = 0; k < 3; ++k)
      if (body.regions[c[k]] != gyre::BodyRegion::inner) area[c[k]] += third;
  }
  return area;
}

// The body's components after one that lifts it: the mean of bodies that stand on the floor stands a hair above it, and
// the template was put down again.
gyre::ShapeSpace space_of(const gyre::BodyTemplate& body) {
  gyre::ShapeSpace space;
  const auto vertices = static_cast<Eigen::Index>(body.mesh.vertices.size());
  space.mean.resize(3 * vertices);
  for (Eigen::Index v = 0; v < vertices; ++v) space.mean.segment<3>(3 * v) = body.mesh.vertices[v];
  space.components = Eigen::MatrixXd::Zero(3 * vertices, 1 + static_cast<Eigen::Index>(body.shapes.size()));
  for (Eigen::Index v = 0; v < vertices; ++v) space.components(3 * v + 1, 0) = 1;
  for (std::size_t k = 0; k < body.shapes.size(); ++k)
    for (std::size_t i = 0; i < body.shapes[k].vertices.size(); ++i)
      space.components.col(1 + static_cast<Eigen::Index>(k)).segment<3>(3 * body.shapes[k].vertices[i]) =
          body.shapes[k].offsets[i].cast<double>();
  return space;
}

Result<void> measure_people(const std::filesystem::path& folder, const gyre::BodyTemplate& body) {
  const auto sources = gyre::read_sources(folder);
  if (!sources) return tl::unexpected(sources.error());
  const auto survey = gyre::read_survey(folder / "ansur");
  if (!survey) return tl::unexpected(survey.error());
  const auto assembled = gyre::assemble_parts(*sources);
  if (!assembled) return tl::unexpected(assembled.error());
  gyre::SurveyBodyOptions options;
  options.count = 100;
  options.held_out = true;
  options.seed = 4711;
  const auto people = gyre::fit_survey_bodies(*sources, *survey, options);
  if (!people) return tl::unexpected(people.error());
  for (std::size_t m = 0; m < gyre::survey_measures.size(); ++m)
    print("people", "measure_error_" + std::string(gyre::survey_measures[m]), 1000 * people->error[m], "mm");

  const gyre::ShapeSpace space = space_of(body);
  Eigen::MatrixXf samples(people->bodies.size(), space.mean.size());
  double joint_squares = 0;
  for (std::size_t i = 0; i < people->bodies.size(); ++i) {
    const auto positions = gyre::bound_positions(assembled->binding, people->bodies[i]);
    for (std::size_t v = 0; v < positions.size(); ++v)
      samples.row(static_cast<Eigen::Index>(i)).segment<3>(3 * static_cast<Eigen::Index>(v)) =
          positions[v].cast<float>().transpose();
    const auto joints = gyre::joint_positions(body, positions),
               wanted = gyre::source_joints(*sources, people->bodies[i]);
    for (std::size_t j = 0; j < joints.size(); ++j)
      joint_squares += (joints[j] - wanted[j]).squaredNorm() / static_cast<double>(joints.size());
  }
  print("held_out", "joint_rms", 1000 * std::sqrt(joint_squares / static_cast<double>(people->bodies.size())), "mm");

  const Eigen::VectorXd area = outer_areas(body);
  for (int count : {10, 20, 24, 30}) {
    if (count > static_cast<int>(body.shapes.size())) break;
    const Eigen::VectorXd errors = gyre::reconstruction_errors(space, samples, area, 1 + count);
    const std::string name = "held_out_" + std::to_string(count) + "_components";
    print(name, "mean", 1000 * errors.mean(), "mm");
    print(name, "worst_body", 1000 * errors.maxCoeff(), "mm");
  }
  return {};
}

void measure_speed(const gyre::BodyTemplate& body) {
  gyre::BodyEvaluator evaluator(body);
  gyre::BodyState state = gyre::rest_state(body);
  const auto wave = [](std::size_t i) { return std::sin(1.7 * static_cast<double>(i)); };
  state.head = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(body.head_shapes.size()));
  state.expression = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(body.expressions.size()));
  for (Eigen::VectorXd* weights : {&state.shape, &state.head, &state.expression})
    for (Eigen::Index i = 0; i < weights->size(); ++i) (*weights)[i] = wave(static_cast<std::size_t>(i));
  for (std::size_t j = 0; j < state.pose.rotations.size(); ++j)
    state.pose.rotations[j] = 0.2 * Eigen::Vector3d(wave(j), wave(2 * j), wave(3 * j));
  // Time of the thread, which other programs do not lengthen.
  const auto cpu_seconds = [] {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  constexpr int repeats = 101;
  std::vector<double> packed, reference;
  for (int i = 0; i < repeats; ++i) {
    const double start = cpu_seconds();
    evaluator.vertices(state);
    packed.push_back(cpu_seconds() - start);
  }
  for (int i = 0; i < repeats / 10; ++i) {
    const double start = cpu_seconds();
    (void)gyre::evaluate(body, state);
    reference.push_back(cpu_seconds() - start);
  }
  for (auto* seconds : {&packed, &reference}) std::sort(seconds->begin(), seconds->end());
  print("forward", "median", 1000 * packed[packed.size() / 2], "ms");
  print("forward", "fastest", 1000 * packed.front(), "ms");
  print("forward", "reference_with_normals_median", 1000 * reference[reference.size() / 2], "ms");
}

void check(const std::string& name, const gyre::BodyTemplate& body) {
  int faults = 0, notes = 0;
  for (const gyre::TemplateFinding& finding : gyre::check_template(body)) {
    ++(finding.is_error ? faults : notes);
    std::fprintf(stderr, "%s: %s: %s\n", name.c_str(), finding.is_error ? "fault" : "note", finding.what.c_str());
  }
  print(name, "check_faults", faults, "1");
  print(name, "check_notes", notes, "1");
}

Result<void> measure(const std::filesystem::path& sources, const std::filesystem::path& file) {
  const auto start = std::chrono::steady_clock::now();
  const auto built = gyre::build_template(sources);
  if (!built) return tl::unexpected(built.error());
  print("build", "seconds", seconds_since(start), "s");
  if (auto written = gyre::write_template(*built, file); !written) return written;
  print("file", "size", static_cast<double>(std::filesystem::file_size(file)) / (1 << 20), "MiB");
  const auto body = gyre::read_template(file);
  if (!body) return tl::unexpected(body.error());
  print("template", "shapes", static_cast<double>(body->shapes.size()), "1");
  print("template", "head_shapes", static_cast<double>(body->head_shapes.size()), "1");
  print("template", "expressions", static_cast<double>(body->expressions.size()), "1");
  print("template", "landmarks", static_cast<double>(body->landmarks.size()), "1");
  check("template", *body);
  check("built_in", gyre::built_in_template());
  measure_speed(*body);
  return measure_people(sources, *body);
}

}  // namespace

int main(int argc, char** argv) {
  gyre::start_logging("body_bench", "warn");
  if (argc != 3) {
    std::fprintf(stderr, "usage: body_bench SOURCES TEMPLATE\n");
    return 2;
  }
  const auto measured = measure(argv[1], argv[2]);
  if (!measured) {
    std::fprintf(stderr, "%s\n", measured.error().message().c_str());
    return measured.error().exit_code();
  }
  return 0;
}
