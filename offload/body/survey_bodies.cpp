// SPDX-License-Identifier: Apache-2.0
#include "offload/body/survey_bodies.h"

#include "common/parallel/parallel.h"
#include "offload/body/base_measures.h"
#include "offload/body/macro_shape.h"

#include <Eigen/Dense>
#include <random>

namespace gyre {
namespace {

constexpr std::size_t held_out_every = 10;

// The parameters of a body: the macro ones, then one a pair of local targets, in [-1, 1].
enum Macro : Eigen::Index { height, weight, muscle, gender, proportions, cup, macro_count };

struct Prior {
  Eigen::VectorXd mean, deviation, least, most;
};

// Widths: MakeHuman's whole range is some five standard deviations of grown people.
Prior prior_of(bool male, Eigen::Index locals) {
  Prior prior;
  prior.mean = Eigen::VectorXd::Zero(macro_count + locals);
  prior.mean.head<macro_count>() << 0.5, 0.5, male ? 0.55 : 0.45, male ? 0.9 : 0.1, 0.5, 0.5;
  prior.deviation = Eigen::VectorXd::Constant(macro_count + locals, 0.3);
  prior.deviation.head<macro_count>() << 0.25, 0.25, 0.17, 0.03, 0.2, male ? 1e-3 : 0.2;
  prior.least = Eigen::VectorXd::Constant(macro_count + locals, -1);
  prior.least.head<macro_count>().setZero();
  prior.most = Eigen::VectorXd::Ones(macro_count + locals);
  return prior;
}

MacroShape macro_of(const Eigen::VectorXd& parameters, double age) {
  MacroShape shape;
  shape.height = parameters[height];
  shape.weight = parameters[weight];
  shape.muscle = parameters[muscle];
  shape.gender = parameters[gender];
  shape.proportions = parameters[proportions];
  shape.cup = parameters[cup];
  shape.age = macro_age(age);
  return shape;
}

// Measures that are wanted, and how exactly.
struct Wanted {
  Measures value{}, deviation{};
};

class BodyFitter {
 public:
  explicit BodyFitter(const Sources& sources) : sources_(sources), measures_(sources) {
    for (const auto& [name, target] : sources.targets)
      if (name.starts_with("measure-") && name.ends_with("-incr"))
        locals_.push_back(name.substr(0, name.size() - std::string_view("incr").size()));
    std::vector<int> place(BaseRanges::count, -1);
    rest_.resize(3, static_cast<Eigen::Index>(measures_.vertices().size()));
    for (std::size_t i = 0; i < measures_.vertices().size(); ++i) {
      const int v = measures_.vertices()[i];
      place[v] = static_cast<int>(i);
      rest_.col(static_cast<Eigen::Index>(i)) = sources.base.vertices[v];
    }
    for (const auto& [name, target] : sources.targets) {
      Target& few = few_[name];
      for (std::size_t i = 0; i < target.vertices.size(); ++i)
        if (place[target.vertices[i]] >= 0) {
          few.vertices.push_back(place[target.vertices[i]]);
          few.offsets.push_back(target.offsets[i]);
        }
    }
  }

  Eigen::Index parameter_count() const { return macro_count + static_cast<Eigen::Index>(locals_.size()); }

  Measures measure(const Eigen::VectorXd& parameters, double age) const {
    return measures_.of(positions(parameters, age));
  }

  // The most probable parameters.
  Eigen::VectorXd fit(const Wanted& wanted, double age, const Prior& prior) const {
    constexpr int iterations = 12;
    constexpr double step = 0.02, enough = 1e-4;
    const Eigen::Index n = parameter_count(), m = std::tuple_size_v<Measures>;
    const auto residuals_of = [&](const Measures& measures) {
      Eigen::VectorXd r(m);
      for (Eigen::Index i = 0; i < m; ++i) r[i] = (measures[i] - wanted.value[i]) / wanted.deviation[i];
      return r;
    };
    const auto cost_of = [&](const Eigen::VectorXd& residuals, const Eigen::VectorXd& p) {
      return residuals.squaredNorm() + ((p - prior.mean).array() / prior.deviation.array()).matrix().squaredNorm();
    };
    Eigen::VectorXd p = prior.mean;
    Eigen::VectorXd residuals = residuals_of(measure(p, age));
    double cost = cost_of(residuals, p), damping = 1e-3;
    for (int i = 0; i < iterations; ++i) {
      const Eigen::Matrix3Xd now = positions(p, age);
      Eigen::MatrixXd slope(m, n);
      for (Eigen::Index k = 0; k < n; ++k) {
        Eigen::VectorXd moved = p;
        moved[k] += p[k] < prior.mean[k] ? step : -step;  // towards the middle, so never out of range
        slope.col(k) = (residuals_of(measures_.of(moved_from(now, p, moved, k, age))) - residuals) / (moved[k] - p[k]);
      }
      const Eigen::VectorXd pull = prior.deviation.array().square().inverse();
      Eigen::MatrixXd hessian = slope.transpose() * slope;
      hessian.diagonal() += pull;
      Eigen::VectorXd gradient = slope.transpose() * residuals + pull.cwiseProduct(p - prior.mean);
      // A parameter that stands at its bound and is pushed against it waits.
      for (Eigen::Index k = 0; k < n; ++k)
        if ((p[k] <= prior.least[k] && gradient[k] > 0) || (p[k] >= prior.most[k] && gradient[k] < 0)) {
          gradient[k] = 0;
          hessian.row(k).setZero();
          hessian.col(k).setZero();
          hessian(k, k) = 1;
        }
      bool better = false;
      double gain = 0;
      constexpr int attempts = 10;
      for (int attempt = 0; attempt < attempts && !better; ++attempt) {
        Eigen::MatrixXd damped = hessian;
        damped.diagonal() *= 1 + damping;
        const Eigen::VectorXd next = (p - damped.ldlt().solve(gradient)).cwiseMax(prior.least).cwiseMin(prior.most);
        const Eigen::VectorXd next_residuals = residuals_of(measure(next, age));
        const double next_cost = cost_of(next_residuals, next);
        better = next_cost < cost;
        damping *= better ? 0.3 : 10;
        if (!better) continue;
        gain = cost - next_cost;
        p = next;
        residuals = next_residuals;
        cost = next_cost;
      }
      if (!better || gain < enough * cost) break;
    }
    return p;
  }

  // All vertices of the base mesh.
  std::vector<Eigen::Vector3d> body(const Eigen::VectorXd& parameters, double age) const {
    std::vector<Eigen::Vector3d> vertices = sources_.base.vertices;
    for (const auto& [name, amount] : macro_targets(macro_of(parameters, age)))
      add_target(sources_.targets, name, amount, vertices);
    for (std::size_t i = 0; i < locals_.size(); ++i) {
      const double amount = parameters[macro_count + static_cast<Eigen::Index>(i)];
      add_target(sources_.targets, locals_[i] + "incr", 0.5 * amount, vertices);
      add_target(sources_.targets, locals_[i] + "decr", -0.5 * amount, vertices);
    }
    return vertices;
  }

 private:
  void add(const std::string& name, double amount, Eigen::Matrix3Xd& at) const {
    const auto found = few_.find(name);
    if (found == few_.end()) return;
    for (std::size_t i = 0; i < found->second.vertices.size(); ++i)
      at.col(found->second.vertices[i]) += amount * found->second.offsets[i].cast<double>();
  }
  // Positions of the measures' vertices.
  Eigen::Matrix3Xd positions(const Eigen::VectorXd& parameters, double age) const {
    Eigen::Matrix3Xd at = rest_;
    for (const auto& [name, amount] : macro_targets(macro_of(parameters, age))) add(name, amount, at);
    for (std::size_t i = 0; i < locals_.size(); ++i)
      add_local(i, parameters[macro_count + static_cast<Eigen::Index>(i)], at);
    return at;
  }
  // The same for `moved`, which differs from p, whose positions are `now`, in parameter k: a local one only adds.
  Eigen::Matrix3Xd moved_from(const Eigen::Matrix3Xd& now, const Eigen::VectorXd& p, const Eigen::VectorXd& moved,
                              Eigen::Index k, double age) const {
    if (k < macro_count) return positions(moved, age);
    const auto local = static_cast<std::size_t>(k - macro_count);
    Eigen::Matrix3Xd at = now;
    add_local(local, moved[k] - p[k], at);
    return at;
  }
  // Of a pair of local targets half the difference, so that a body moves by them in straight lines.
  void add_local(std::size_t local, double amount, Eigen::Matrix3Xd& at) const {
    add(locals_[local] + "incr", 0.5 * amount, at);
    add(locals_[local] + "decr", -0.5 * amount, at);
  }

  const Sources& sources_;
  BaseMeasures measures_;
  std::vector<std::string> locals_;  // "measure-...-", completed by incr and decr
  Eigen::Matrix3Xd rest_;            // the measures' vertices of the base mesh
  TargetSet few_;                    // the targets on these vertices
};

// The correlated part of people's measures and age: their projection on the leading principal components of what the
// people that are not held out measure, in standard deviations. The rest is posture, breath and the measurers' scatter.
class TypicalPeople {
 public:
  explicit TypicalPeople(const Survey::Sex& sex) {
    constexpr Eigen::Index kept = 10;
    const std::vector<std::size_t> rows = trained_people(sex.people.size());
    Eigen::MatrixXd all(rows.size(), size);
    for (std::size_t r = 0; r < rows.size(); ++r)
      all.row(static_cast<Eigen::Index>(r)) = vector_of(sex.people[rows[r]]).transpose();
    mean_ = all.colwise().mean().transpose();
    all.rowwise() -= mean_.transpose();
    deviation_ = (all.colwise().squaredNorm() / static_cast<double>(rows.size() - 1)).cwiseSqrt().transpose();
    all = all * deviation_.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(all.transpose() * all);
    directions_ = eigen.eigenvectors().rightCols<kept>();
  }

  Person of(const Person& person) const {
    const Eigen::VectorXd standard = (vector_of(person) - mean_).cwiseQuotient(deviation_);
    const Eigen::VectorXd kept = mean_ + deviation_.cwiseProduct(directions_ * (directions_.transpose() * standard));
    Person typical;
    Eigen::Map<Eigen::VectorXd>(typical.measures.data(), size - 1) = kept.head(size - 1);
    constexpr double grown = 25, oldest = 70;  // below 25 the sources' human is part child, which a soldier is not
    typical.age = std::clamp(kept[size - 1], grown, oldest);
    return typical;
  }

 private:
  static constexpr Eigen::Index size = std::tuple_size_v<Measures> + 1;
  static std::vector<std::size_t> trained_people(std::size_t people) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < people; ++i)
      if (i % held_out_every != 0) rows.push_back(i);
    return rows;
  }
  static Eigen::VectorXd vector_of(const Person& person) {
    Eigen::VectorXd vector(size);
    vector << Eigen::Map<const Eigen::VectorXd>(person.measures.data(), size - 1), person.age;
    return vector;
  }

  Eigen::VectorXd mean_, deviation_;
  Eigen::MatrixXd directions_;
};

// How exactly a measure is met: a share of how much people differ in it.
constexpr double measure_tolerance = 0.2;

// The mean person of a sex from the measures that need no reference, as measured on the mesh.
Measures reference_of(const BodyFitter& fitter, const Survey::Sex& sex, const Prior& prior, double age) {
  Wanted wanted;
  wanted.value = sex.mean;
  for (std::size_t m = 0; m < wanted.value.size(); ++m)
    wanted.deviation[m] = BaseMeasures::is_exact(m) ? measure_tolerance * sex.deviation[m] : 1e3;
  return fitter.measure(fitter.fit(wanted, age, prior), age);
}

Wanted wanted_of(const Person& person, const Survey::Sex& sex, const Measures& reference) {
  Wanted wanted;
  for (std::size_t m = 0; m < wanted.value.size(); ++m) {
    const double ratio = BaseMeasures::is_exact(m) ? 1 : reference[m] / sex.mean[m];
    wanted.value[m] = ratio * person.measures[m];
    wanted.deviation[m] = measure_tolerance * ratio * sex.deviation[m];
  }
  return wanted;
}

// A random order of the people that are, or are not, held out.
std::vector<std::size_t> drawn_people(std::size_t people, bool held_out, std::uint64_t seed) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < people; ++i)
    if ((i % held_out_every == 0) == held_out) order.push_back(i);
  std::mt19937_64 random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  return order;
}

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

Result<SurveyBodies> fit_survey_bodies(const Sources& sources, const Survey& survey, const SurveyBodyOptions& options) {
  for (const char* bone :
       {"spine05", "lowerleg01.L", "foot.L", "neck01", "head", "upperarm01.L", "lowerarm01.L", "wrist.L"})
    if (!sources.bones.count(bone)) return fail("rig without bone '" + std::string(bone) + "'");
  const BodyFitter fitter(sources);
  const std::array<const Survey::Sex*, 2> sexes = {&survey.female, &survey.male};
  const std::array<TypicalPeople, 2> typical = {TypicalPeople(survey.female), TypicalPeople(survey.male)};
  std::array<Prior, 2> priors;
  std::array<Measures, 2> references;
  std::array<std::vector<std::size_t>, 2> people;
  constexpr double middle_age = 30;
  for (std::size_t male = 0; male < 2; ++male) {
    priors[male] = prior_of(male == 1, fitter.parameter_count() - macro_count);
    references[male] = reference_of(fitter, *sexes[male], priors[male], middle_age);
    people[male] = drawn_people(sexes[male]->people.size(), options.held_out, options.seed);
  }
  const std::size_t count =
      std::min({static_cast<std::size_t>(options.count), 2 * people[0].size(), 2 * people[1].size()});
  SurveyBodies result;
  result.bodies.resize(count);
  std::vector<Measures> missed(count);
  parallel_for(count, options.threads, [&](std::size_t i) {
    const std::size_t male = i % 2;
    const Person person = typical[male].of(sexes[male]->people[people[male][i / 2]]);
    const Wanted wanted = wanted_of(person, *sexes[male], references[male]);
    const Eigen::VectorXd parameters = fitter.fit(wanted, person.age, priors[male]);
    const Measures got = fitter.measure(parameters, person.age);
    for (std::size_t m = 0; m < got.size(); ++m) missed[i][m] = got[m] - wanted.value[m];
    constexpr double out_of_reach = 0.04;  // metres of stature or waist girth
    constexpr std::size_t stature = 0, waist = 4;
    if (std::max(std::abs(missed[i][stature]), std::abs(missed[i][waist])) > out_of_reach) return;
    result.bodies[i] = grounded(fitter.body(parameters, person.age), sources.bones.at("spine05").head);
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (result.bodies[i].empty()) continue;
    for (std::size_t m = 0; m < missed[i].size(); ++m) result.error[m] += missed[i][m] * missed[i][m];
    if (kept != i) result.bodies[kept] = std::move(result.bodies[i]);
    result.male.push_back(i % 2 == 1);
    ++kept;
  }
  if (kept < 0.95 * static_cast<double>(count))
    return fail("the targets do not reach the survey's bodies",
                std::to_string(count - kept) + " of " + std::to_string(count));
  result.bodies.resize(kept);
  for (double& error : result.error) error = std::sqrt(error / static_cast<double>(kept));
  return result;
}

}  // namespace gyre
