// SPDX-License-Identifier: Apache-2.0
#include "offload/body/body_measures.h"

namespace gyre {
namespace {

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

// Andrew's monotone chain (1979).
double hull_length(std::vector<Eigen::Vector2d> points) {
  if (points.size() < 2) return 0;
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y()); });
  std::vector<Eigen::Vector2d> hull;
  const auto add_chain = [&](auto first, auto last) {
    const std::size_t start = hull.size();
    for (; first != last; ++first) {
      while (hull.size() >= start + 2 && cross(hull[hull.size() - 2], hull.back(), *first) <= 0) hull.pop_back();
      hull.push_back(*first);
    }
    hull.pop_back();
  };
  add_chain(points.begin(), points.end());
  add_chain(points.rbegin(), points.rend());
  double length = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) length += (hull[(i + 1) % hull.size()] - hull[i]).norm();
  return length;
}

}  // namespace

double girth(const std::vector<Eigen::Vector3d>& vertices, std::span<const Eigen::Vector3i> triangles, double level) {
  std::vector<Eigen::Vector2d> cut;
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d &a = vertices[t[k]], &b = vertices[t[(k + 1) % 3]];
      if ((a.y() <= level) == (b.y() <= level)) continue;
      const Eigen::Vector3d at = a + (level - a.y()) / (b.y() - a.y()) * (b - a);
      cut.emplace_back(at.x(), at.z());
    }
  return hull_length(std::move(cut));
}

double stature(const std::vector<Eigen::Vector3d>& vertices, std::size_t count) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t v = 0; v < std::min(count, vertices.size()); ++v) {
    low = std::min(low, vertices[v].y());
    high = std::max(high, vertices[v].y());
  }
  return high - low;
}

Tape tape_through(const std::vector<Eigen::Vector3d>& vertices, std::span<const Eigen::Vector3i> triangles,
                  const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  Tape tape;
  tape.normal = normal;
  std::set<std::pair<int, int>> crossed;
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = std::min(t[k], t[(k + 1) % 3]), b = std::max(t[k], t[(k + 1) % 3]);
      const double from = normal.dot(vertices[a] - point), to = normal.dot(vertices[b] - point);
      if ((from <= 0) == (to <= 0) || !crossed.emplace(a, b).second) continue;
      tape.crossings.push_back({a, b, from / (from - to)});
    }
  return tape;
}

double girth(const Eigen::Matrix3Xd& vertices, const Tape& tape) {
  const Eigen::Vector3d u = tape.normal.unitOrthogonal(), v = tape.normal.cross(u);
  std::vector<Eigen::Vector2d> cut;
  for (const Tape::Crossing& c : tape.crossings) {
    const Eigen::Vector3d at = (1 - c.at_b) * vertices.col(c.a) + c.at_b * vertices.col(c.b);
    cut.emplace_back(u.dot(at), v.dot(at));
  }
  return hull_length(std::move(cut));
}

double extent(const Eigen::Matrix3Xd& vertices, const Tape& tape, int axis) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Tape::Crossing& c : tape.crossings) {
    const double at = (1 - c.at_b) * vertices(axis, c.a) + c.at_b * vertices(axis, c.b);
    low = std::min(low, at);
    high = std::max(high, at);
  }
  return std::max(0.0, high - low);
}

}  // namespace gyre
