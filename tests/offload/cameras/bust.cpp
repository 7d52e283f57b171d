// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/cameras/bust.h"

#include <array>
#include <random>

namespace gyre {

namespace {

struct Ellipsoid {
  Eigen::Vector3d centre;
  Eigen::Vector3d radii;

  double level(const Eigen::Vector3d& p) const { return (p - centre).cwiseQuotient(radii).norm(); }
};

// Head, nose, neck, a shoulder each, trunk, legs: nothing that looks the same after a turn about the vertical.
const std::array<Ellipsoid, 7> parts = {
    Ellipsoid{{0, 1.58, 0.01}, {0.075, 0.12, 0.095}},    Ellipsoid{{0, 1.56, 0.11}, {0.018, 0.03, 0.03}},
    Ellipsoid{{0, 1.44, -0.01}, {0.055, 0.09, 0.06}},    Ellipsoid{{0.15, 1.38, -0.02}, {0.09, 0.06, 0.07}},
    Ellipsoid{{-0.15, 1.37, -0.01}, {0.09, 0.06, 0.07}}, Ellipsoid{{0, 1.15, 0}, {0.17, 0.3, 0.12}},
    Ellipsoid{{0, 0.45, 0}, {0.15, 0.47, 0.11}}};

}  // namespace

std::vector<SurfacePoint> sample_bust(int count, double lowest, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1.0p-53;
  };
  std::vector<SurfacePoint> points;
  while (static_cast<int>(points.size()) < count) {
    const Ellipsoid& part = parts[engine() % parts.size()];
    const Eigen::Vector3d q(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    if (q.norm() > 1 || q.norm() < 0.1) continue;
    const Eigen::Vector3d direction = q.normalized();
    const Eigen::Vector3d p = part.centre + direction.cwiseProduct(part.radii);
    if (p.y() < lowest) continue;
    bool hidden = false;
    for (const Ellipsoid& other : parts) hidden = hidden || (&other != &part && other.level(p) < 1);
    if (!hidden) points.push_back({p, direction.cwiseQuotient(part.radii).normalized()});
  }
  return points;
}

}  // namespace gyre
