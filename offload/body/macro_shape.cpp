// SPDX-License-Identifier: Apache-2.0
#include "offload/body/macro_shape.h"

namespace gyre {
namespace {

// The one or two neighbours of a value on a scale, with weights; an empty name stands for the base mesh itself.
using Blend = std::vector<std::pair<std::string, double>>;

Blend blend(double value, const std::vector<std::pair<double, std::string>>& scale) {
  if (value <= scale.front().first) return {{scale.front().second, 1.0}};
  for (std::size_t i = 1; i < scale.size(); ++i) {
    const auto& [high, high_name] = scale[i];
    const auto& [low, low_name] = scale[i - 1];
    if (value > high) continue;
    const double t = (value - low) / (high - low);
    return {{low_name, 1 - t}, {high_name, t}};
  }
  return {{scale.back().second, 1.0}};
}

// Names joined with "-", weights multiplied; parts with an empty name or no weight fall away.
Blend product(const std::vector<Blend>& factors) {
  Blend result = {{"", 1.0}};
  for (const Blend& factor : factors) {
    Blend longer;
    for (const auto& [name, weight] : result)
      for (const auto& [part, part_weight] : factor)
        if (!part.empty() && weight * part_weight > 0)
          longer.emplace_back(name.empty() ? part : name + "-" + part, weight * part_weight);
    result = std::move(longer);
  }
  return result;
}

}  // namespace

double macro_age(double years) {
  constexpr double child = 10, adult = 25, old = 90;
  constexpr double child_value = 0.1875, adult_value = 0.5;
  if (years < adult) return child_value + (years - child) / (adult - child) * (adult_value - child_value);
  return adult_value + (years - adult) / (old - adult) * (1 - adult_value);
}

std::vector<std::pair<std::string, double>> macro_targets(const MacroShape& shape) {
  const Blend gender = blend(shape.gender, {{0, "female"}, {1, "male"}});
  const Blend age = blend(shape.age, {{0, "baby"}, {0.1875, "child"}, {0.5, "young"}, {1, "old"}});
  const Blend muscle = blend(shape.muscle, {{0, "minmuscle"}, {0.5, "averagemuscle"}, {1, "maxmuscle"}});
  const Blend weight = blend(shape.weight, {{0, "minweight"}, {0.5, "averageweight"}, {1, "maxweight"}});
  const Blend height = blend(shape.height, {{0, "minheight"}, {0.5, ""}, {1, "maxheight"}});
  const Blend proportions = blend(shape.proportions, {{0, "uncommonproportions"}, {0.5, ""}, {1, "idealproportions"}});
  const Blend cup = blend(shape.cup, {{0, "mincup"}, {0.5, "averagecup"}, {1, "maxcup"}});
  const Blend firmness = blend(shape.firmness, {{0, "minfirmness"}, {0.5, "averagefirmness"}, {1, "maxfirmness"}});
  const Blend ancestry = {
      {"african", shape.ancestry[0]}, {"asian", shape.ancestry[1]}, {"caucasian", shape.ancestry[2]}};

  Blend targets;
  for (const auto& factors : std::vector<std::vector<Blend>>{{{{"universal", 1.0}}, gender, age, muscle, weight},
                                                             {gender, age, muscle, weight, height},
                                                             {gender, age, muscle, weight, proportions},
                                                             {gender, age, muscle, weight, cup, firmness},
                                                             {ancestry, gender, age}}) {
    const Blend more = product(factors);
    targets.insert(targets.end(), more.begin(), more.end());
  }
  return targets;
}

void add_target(const TargetSet& targets, const std::string& name, double weight,
                std::vector<Eigen::Vector3d>& vertices) {
  const auto found = targets.find(name);
  if (found == targets.end()) return;
  const Target& target = found->second;
  for (std::size_t i = 0; i < target.vertices.size(); ++i)
    vertices[target.vertices[i]] += weight * target.offsets[i].cast<double>();
}

}  // namespace gyre
