// SPDX-License-Identifier: Apache-2.0
#include "offload/body/shape_space.h"

#include "common/parallel/parallel.h"
#include "offload/body/body_measures.h"
#include "offload/body/macro_shape.h"

#include <Eigen/Dense>
#include <random>

namespace gyre {
namespace {

// Vertices of hm08 that mark the levels of the girths: navel, nipple, rearmost point of the buttocks.
constexpr int navel = 4121, nipple = 8451, buttock = 10854;
constexpr int attempts_per_body = 40;
constexpr double reached = 0.004;  // metres of stature or waist girth

// Uniform and normal numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal(double mean, double sd, double low, double high) {
    constexpr double two_pi = 6.283185307179586;
    const double u = 1 - uniform(), v = uniform();  // Box and Muller (1958)
    return std::clamp(mean + sd * std::sqrt(-2 * std::log(u)) * std::cos(two_pi * v), low, high);
  }

 private:
  std::mt19937_64 engine_;
};

class BodySampler {
 public:
  BodySampler(const Sources& sources, const BodySampleOptions& options) : sources_(sources), options_(options) {
    for (const auto& [name, target] : sources.targets)
      if (name.starts_with("measure-") && name.ends_with("-incr"))
        local_.push_back(name.substr(0, name.size() - std::string_view("incr").size()));
    for (const Eigen::Vector3i& t : sources.base.triangles)
      if ((t.array() < BaseRanges::body).all() && on_trunk(t)) trunk_.push_back(t);
  }

  // A body like `person`; empty when the parameters cannot make one.
  std::vector<Eigen::Vector3d> draw(const Survey::Sex& sex, bool male, Random& random) const {
    const Person& person =
        sex.people[static_cast<std::size_t>(random.uniform() * static_cast<double>(sex.people.size()))];
    MacroShape shape;
    const double toward_average = std::abs(random.normal(0, 0.12, -0.4, 0.4));
    shape.gender = male ? 1 - toward_average : toward_average;
    shape.age = macro_age(random.uniform(18, 70));
    shape.muscle = random.normal(male ? 0.55 : 0.45, 0.17, 0.05, 0.95);
    shape.proportions = random.normal(0.5, 0.2, 0, 1);
    shape.cup = random.normal(0.5, 0.2, 0, 1);
    shape.firmness = random.normal(0.5, 0.2, 0, 1);
    double sum = 0;
    for (double& share : shape.ancestry) sum += share = -std::log(1 - random.uniform());
    for (double& share : shape.ancestry) share /= sum;
    std::vector<double> local;
    for (std::size_t i = 0; i < local_.size(); ++i) local.push_back(random.normal(0, options_.local_sd, -1, 1));

    const auto within = [&](double Person::*measure, double value) {
      return value >= sex.lowest.*measure && value <= sex.highest.*measure;
    };
    if (!within(&Person::stature, person.stature) || !within(&Person::waist, person.waist)) return {};
    std::vector<Eigen::Vector3d> body = with_local(local);
    if (!solve(person, shape, body)) return {};
    add_macro(shape, body);
    if (!within(&Person::chest, girth(body, trunk_, body[nipple].y())) ||
        !within(&Person::buttock, girth(body, trunk_, body[buttock].y())))
      return {};
    return body;
  }

 private:
  bool on_trunk(const Eigen::Vector3i& t) const {
    // The arms of the base mesh lie beyond the armpits' |x|; what is left holds trunk, head and legs.
    constexpr double armpit_x = 0.19;
    for (int k = 0; k < 3; ++k)
      if (std::abs(sources_.base.vertices[t[k]].x()) > armpit_x && sources_.base.vertices[t[k]].y() > 0) return false;
    return true;
  }

  std::vector<Eigen::Vector3d> with_local(const std::vector<double>& amounts) const {
    std::vector<Eigen::Vector3d> vertices = sources_.base.vertices;
    for (std::size_t i = 0; i < local_.size(); ++i)
      add_target(sources_.targets, local_[i] + (amounts[i] > 0 ? "incr" : "decr"), std::abs(amounts[i]), vertices);
    return vertices;
  }

  void add_macro(const MacroShape& shape, std::vector<Eigen::Vector3d>& vertices) const {
    for (const auto& [name, weight] : macro_targets(shape)) add_target(sources_.targets, name, weight, vertices);
  }

  // Stature and waist girth less the person's.
  Eigen::Vector2d excess(const Person& person, const MacroShape& shape, std::vector<Eigen::Vector3d> body) const {
    add_macro(shape, body);
    return {stature(body, BaseRanges::body) - person.stature, girth(body, trunk_, body[navel].y()) - person.waist};
  }

  // Newton's method with numeric derivatives on the height and weight parameters.
  bool solve(const Person& person, MacroShape& shape, const std::vector<Eigen::Vector3d>& body) const {
    constexpr int iterations = 6;
    constexpr double step = 0.02;
    for (int i = 0; i <= iterations; ++i) {
      const Eigen::Vector2d now = excess(person, shape, body);
      if (now.cwiseAbs().maxCoeff() < reached) return true;
      if (i == iterations) break;
      MacroShape taller = shape, heavier = shape;
      const double up = shape.height < 0.5 ? step : -step, more = shape.weight < 0.5 ? step : -step;
      taller.height += up;
      heavier.weight += more;
      Eigen::Matrix2d slope;
      slope.col(0) = (excess(person, taller, body) - now) / up;
      slope.col(1) = (excess(person, heavier, body) - now) / more;
      if (std::abs(slope.determinant()) < 1e-6) return false;
      const Eigen::Vector2d move = slope.inverse() * now;
      shape.height = std::clamp(shape.height - move[0], 0.0, 1.0);
      shape.weight = std::clamp(shape.weight - move[1], 0.0, 1.0);
    }
    return false;
  }

  const Sources& sources_;
  const BodySampleOptions& options_;
  std::vector<std::string> local_;  // "measure-...-", to be followed by incr or decr
  std::vector<Eigen::Vector3i> trunk_;
};

std::vector<Eigen::Vector3f> grounded(const std::vector<Eigen::Vector3d>& body, const std::vector<int>& pelvis) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (int v : pelvis) origin += body[v] / static_cast<double>(pelvis.size());
  origin.y() = body[0].y();
  for (int v = 0; v < BaseRanges::body; ++v) origin.y() = std::min(origin.y(), body[v].y());
  std::vector<Eigen::Vector3f> moved;
  moved.reserve(body.size());
  for (const Eigen::Vector3d& v : body) moved.emplace_back((v - origin).cast<float>());
  return moved;
}

}  // namespace

Result<std::vector<std::vector<Eigen::Vector3f>>> sample_bodies(const Sources& sources, const Survey& survey,
                                                                const BodySampleOptions& options) {
  const auto pelvis = sources.bones.find("spine05");
  if (pelvis == sources.bones.end()) return fail("rig without bone 'spine05'");
  const BodySampler sampler(sources, options);
  std::vector<std::vector<Eigen::Vector3f>> bodies(static_cast<std::size_t>(options.count));
  parallel_for(bodies.size(), options.threads, [&](std::size_t i) {
    const bool male = i % 2 == 1;
    Random random(options.seed * 1000003 + i);
    for (int attempt = 0; attempt < attempts_per_body && bodies[i].empty(); ++attempt) {
      const auto body = sampler.draw(male ? survey.male : survey.female, male, random);
      if (!body.empty()) bodies[i] = grounded(body, pelvis->second.head);
    }
  });
  const auto missing = std::count_if(bodies.begin(), bodies.end(), [](const auto& b) { return b.empty(); });
  if (missing > options.count / 20)
    return fail("the targets do not reach the survey's bodies", std::to_string(missing) + " samples");
  std::erase_if(bodies, [](const auto& b) { return b.empty(); });
  return bodies;
}

ShapeSpace principal_components(const Eigen::MatrixXf& samples, const Eigen::VectorXd& weight, int count) {
  const Eigen::Index n = samples.rows();
  ShapeSpace space;
  space.mean = samples.cast<double>().colwise().mean().transpose();
  Eigen::RowVectorXf root(samples.cols());
  for (Eigen::Index c = 0; c < samples.cols(); ++c) root[c] = static_cast<float>(std::sqrt(weight[c / 3]));
  const Eigen::MatrixXf deviations = samples.rowwise() - space.mean.transpose().cast<float>();
  const Eigen::MatrixXf weighted = deviations.array().rowwise() * root.array();
  const Eigen::MatrixXd gram = (weighted * weighted.transpose()).cast<double>() / static_cast<double>(n - 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gram);
  space.components.resize(samples.cols(), count);
  space.explained.resize(count);
  for (int k = 0; k < count; ++k) {
    const Eigen::Index at = n - 1 - k;
    // A sample's coordinate along component k is sqrt(n - 1) times its entry in the eigenvector, in standard
    // deviations, so the deviations' mean along the eigenvector is the component of one standard deviation.
    const Eigen::VectorXf coordinate = (eigen.eigenvectors().col(at) / std::sqrt(double(n - 1))).cast<float>();
    Eigen::VectorXd component = (deviations.transpose() * coordinate).cast<double>();
    Eigen::Index largest = 0;
    component.cwiseAbs().maxCoeff(&largest);
    if (component[largest] < 0) component = -component;
    space.components.col(k) = component;
    space.explained[k] = eigen.eigenvalues()[at] / gram.trace();
  }
  return space;
}

}  // namespace gyre
