// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/body/random_person.h"

#include "offload/body/face_contacts.h"
#include "offload/body/inner_parts.h"

#include <numbers>
#include <random>

namespace gyre {

std::vector<Eigen::Vector3d> random_person(const BodyTemplate& body, std::uint64_t seed, double amplitude) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd shape(static_cast<Eigen::Index>(body.shapes.size()));
  for (double& s : shape) s = std::clamp(normal(random), -2.0, 2.0);
  const std::vector<Eigen::Vector3d> shaped = shaped_vertices(body, shape);
  std::vector<Eigen::Vector3d> person = shaped;
  const TemplatePart& skin = *body.part("body");
  constexpr int waves = 8;
  constexpr double length = 0.15;  // metres
  for (int k = 0; k < waves; ++k) {
    const auto direction = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
    const Eigen::Vector3d wave = 2 * std::numbers::pi / length / std::sqrt(3.0) * direction();
    const Eigen::Vector3d push = amplitude / std::sqrt(waves) * direction();
    const double phase = 2 * std::numbers::pi * k / waves;
    for (int v = 0; v < skin.vertex_count; ++v) person[v] += std::sin(wave.dot(shaped[v]) + phase) * push;
  }
  carry_inner_parts(body, shaped, person);
  settle_face(body, person);
  return person;
}

}  // namespace gyre
