// SPDX-License-Identifier: Apache-2.0
#include "offload/body/face_openings.h"

#include <Eigen/Geometry>
#include <cassert>
#include <limits>

namespace gyre {

namespace {

// Closed chains of edges between vertices of the skin that touch the lining; other shapes are no openings.
std::vector<std::vector<int>> rim_loops(const BodyTemplate& body, const TemplatePart& part) {
  const auto inner = [&](int v) { return body.regions[v] == BodyRegion::inner; };
  const auto corner = [&](int t, int k) { return body.mesh.triangles[part.first_triangle + t][k % 3]; };
  std::set<int> rim;
  for (int t = 0; t < part.triangle_count; ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = corner(t, k), b = corner(t, k + 1);
      if (inner(a) != inner(b)) rim.insert(inner(a) ? b : a);
    }
  std::map<int, std::set<int>> beside;
  for (int t = 0; t < part.triangle_count; ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = corner(t, k), b = corner(t, k + 1);
      if (!rim.count(a) || !rim.count(b)) continue;
      beside[a].insert(b);
      beside[b].insert(a);
    }
  std::vector<std::vector<int>> loops;
  std::set<int> seen;
  for (const int start : rim) {
    if (seen.count(start)) continue;
    std::vector<int> loop;
    bool closed = true;
    for (int at = start; at >= 0;) {
      loop.push_back(at);
      seen.insert(at);
      closed = closed && beside[at].size() == 2;
      int next = -1;
      for (const int b : beside[at])
        if (!seen.count(b)) next = b;
      at = next;
    }
    constexpr std::size_t fewest = 6;
    if (closed && loop.size() >= fewest) loops.push_back(std::move(loop));
  }
  return loops;
}

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& vertices, const std::vector<int>& of) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int v : of) sum += vertices[v];
  return sum / static_cast<double>(of.size());
}

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& vertices, const TemplatePart& part) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int v = 0; v < part.vertex_count; ++v) sum += vertices[part.first_vertex + v];
  return sum / std::max(1, part.vertex_count);
}

// Corners are the two vertices furthest apart.
FaceOpening split_loop(std::string name, const std::vector<int>& loop, const std::vector<Eigen::Vector3d>& vertices) {
  std::size_t first = 0, second = 0;
  double widest = -1.0;
  for (std::size_t i = 0; i < loop.size(); ++i)
    for (std::size_t k = i + 1; k < loop.size(); ++k)
      if (const double apart = (vertices[loop[i]] - vertices[loop[k]]).squaredNorm(); apart > widest) {
        widest = apart;
        first = i;
        second = k;
      }
  if (vertices[loop[first]].x() > vertices[loop[second]].x()) std::swap(first, second);
  const auto walk = [&](std::size_t step) {
    std::vector<int> half;
    for (std::size_t i = first;; i = (i + step) % loop.size()) {
      half.push_back(loop[i]);
      if (i == second) return half;
    }
  };
  FaceOpening opening{std::move(name), walk(1), walk(loop.size() - 1)};
  if (middle_of(vertices, opening.upper).y() < middle_of(vertices, opening.lower).y())
    std::swap(opening.upper, opening.lower);
  return opening;
}

}  // namespace

std::vector<FaceOpening> find_face_openings(const BodyTemplate& body) {
  std::vector<FaceOpening> openings;
  const TemplatePart* skin = body.part("body");
  if (skin == nullptr) return openings;
  std::vector<std::vector<int>> loops = rim_loops(body, *skin);
  for (const auto& [name, beside] : {std::pair("leftEye", "leftEye"), std::pair("rightEye", "rightEye"),
                                     std::pair("mouth", "upperTeeth"), std::pair("mouth", "tongue")}) {
    const TemplatePart* part = body.part(beside);
    const bool known = !openings.empty() && openings.back().name == name;
    if (part == nullptr || loops.empty() || known) continue;
    const Eigen::Vector3d centre = middle_of(body.mesh.vertices, *part);
    const auto distance = [&](const std::vector<int>& loop) {
      return (middle_of(body.mesh.vertices, loop) - centre).norm();
    };
    const auto nearest = std::min_element(loops.begin(), loops.end(),
                                          [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    constexpr double reach = 0.06;  // metres; a rim further off belongs to something else
    if (distance(*nearest) > reach) continue;
    openings.push_back(split_loop(name, *nearest, body.mesh.vertices));
    loops.erase(nearest);
  }
  return openings;
}

OpeningFrame opening_frame(const FaceOpening& opening, const std::vector<Eigen::Vector3d>& vertices) {
  OpeningFrame frame;
  const Eigen::Vector3d &first = vertices[opening.upper.front()], &last = vertices[opening.upper.back()];
  frame.across = (last - first).normalized();
  // The rims bulge out of the line between the corners; how far is the same for both, how far up is not.
  const Eigen::Vector3d bulge =
      0.5 * (middle_of(vertices, opening.upper) + middle_of(vertices, opening.lower)) - 0.5 * (first + last);
  const Eigen::Vector3d out = bulge - frame.across * frame.across.dot(bulge);
  frame.out = out.normalized();
  frame.up = frame.out.cross(frame.across);
  return frame;
}

std::vector<RimPair> pair_rims(const FaceOpening& opening, const std::vector<Eigen::Vector3d>& vertices,
                               const OpeningFrame& frame) {
  std::vector<RimPair> pairs;
  for (const bool upper : {true, false}) {
    const std::vector<int>& own = upper ? opening.upper : opening.lower;
    const std::vector<int>& other = upper ? opening.lower : opening.upper;
    for (std::size_t i = 1; i + 1 < own.size(); ++i) {
      const double place = frame.across.dot(vertices[own[i]]);
      RimPair pair{own[i], upper, {other[0], other[1]}, 0.0};
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k + 1 < other.size(); ++k) {
        const double from = frame.across.dot(vertices[other[k]]), to = frame.across.dot(vertices[other[k + 1]]);
        const double weight = to != from ? std::clamp((place - from) / (to - from), 0.0, 1.0) : 0.0;
        const double miss = std::abs(from + weight * (to - from) - place);
        if (miss >= least) continue;
        least = miss;
        pair.opposite = {other[k], other[k + 1]};
        pair.weight = weight;
      }
      pairs.push_back(pair);
    }
  }
  return pairs;
}

Eigen::Vector3d gap_of(const RimPair& pair, const std::vector<Eigen::Vector3d>& vertices) {
  const Eigen::Vector3d gap = vertices[pair.vertex] - (1.0 - pair.weight) * vertices[pair.opposite[0]] -
                              pair.weight * vertices[pair.opposite[1]];
  return pair.upper ? gap : Eigen::Vector3d(-gap);
}

}  // namespace gyre
