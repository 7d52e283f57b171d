// SPDX-License-Identifier: Apache-2.0
#include "offload/body/inner_parts.h"

#include "common/geometry/pose.h"
#include "common/geometry/quantile.h"

#include <limits>

namespace gyre {

namespace {

constexpr int nearest_vertices = 80;  // body vertices that say where a part goes, one part
constexpr double least_change = 0.5, most_change = 1.5;
constexpr double eye_change = 0.06;  // of an eyeball's size at most

struct Range {
  int first = 0, last = 0;
};

// The body vertices nearest to any vertex of the parts.
std::vector<int> surroundings(const TemplatePart& skin, const std::vector<Range>& parts,
                              const std::vector<Eigen::Vector3d>& x, std::size_t count) {
  Eigen::AlignedBox3d box;
  for (const Range& r : parts)
    for (int v = r.first; v < r.last; ++v) box.extend(x[v]);
  constexpr double reach = 0.05;  // metres around the parts that are searched first
  std::vector<std::pair<double, int>> distances;
  for (const double limit : {reach, std::numeric_limits<double>::infinity()}) {
    if (distances.size() >= count) break;
    distances.clear();
    for (int v = skin.first_vertex; v < skin.first_vertex + skin.vertex_count; ++v) {
      if (box.exteriorDistance(x[v]) > limit) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const Range& r : parts)
        for (int p = r.first; p < r.last; ++p) nearest = std::min(nearest, (x[v] - x[p]).squaredNorm());
      distances.emplace_back(nearest, v);
    }
  }
  count = std::min(count, distances.size());
  std::partial_sort(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(count), distances.end());
  std::vector<int> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(distances[i].second);
  return chosen;
}

// after_from_before of the given vertices, with a change of size of at most `change` either way.
Similarity motion_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& before,
                     const std::vector<Eigen::Vector3d>& after, double change) {
  Similarity moved;
  if (vertices.empty()) return moved;
  std::vector<Eigen::Vector3d> from, to;
  Eigen::Vector3d from_middle = Eigen::Vector3d::Zero(), to_middle = Eigen::Vector3d::Zero();
  for (const int v : vertices) {
    from.push_back(before[v]);
    to.push_back(after[v]);
    from_middle += before[v] / static_cast<double>(vertices.size());
    to_middle += after[v] / static_cast<double>(vertices.size());
  }
  if (const auto found = align_points(to, from); found && found->scale > least_change && found->scale < most_change)
    moved = *found;
  moved.scale = std::clamp(moved.scale, 1.0 - change, 1.0 + change);
  moved.translation = to_middle - moved.scale * (moved.rotation * from_middle);
  return moved;
}

// How far the lids stand out of the nearest point of the eyeball's front, along `out`, one a rim vertex.
std::vector<double> depths(const FaceOpening& lids, const Range& eye, const std::vector<Eigen::Vector3d>& x) {
  const Eigen::Vector3d out = opening_frame(lids, x).out;
  std::vector<double> found;
  for (const auto* half : {&lids.upper, &lids.lower})
    for (const int v : *half) {
      double least = std::numeric_limits<double>::infinity(), height = 0.0;
      for (int p = eye.first; p < eye.last; ++p) {
        const Eigen::Vector3d to = x[p] - x[v];
        const double along = to.dot(out), aside = (to - along * out).squaredNorm();
        // The front, not what lies behind it on the same line.
        if (aside + 0.01 * (to.squaredNorm() - aside) >= least) continue;
        least = aside + 0.01 * (to.squaredNorm() - aside);
        height = -along;
      }
      found.push_back(height);
    }
  return found;
}

void seat_eye(const FaceOpening& lids, const Range& eye, double scale, const std::vector<Eigen::Vector3d>& before,
              std::vector<Eigen::Vector3d>& after) {
  const std::vector<double> was = depths(lids, eye, before), is = depths(lids, eye, after);
  std::vector<double> deeper;
  for (std::size_t i = 0; i < was.size(); ++i) deeper.push_back(is[i] - scale * was[i]);
  const Eigen::Vector3d shift = median(deeper) * opening_frame(lids, after).out;
  for (int p = eye.first; p < eye.last; ++p) after[p] += shift;
}

}  // namespace

void carry_inner_parts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& before,
                       std::vector<Eigen::Vector3d>& after) {
  const TemplatePart* skin = body.part("body");
  if (skin == nullptr) return;
  const std::vector<FaceOpening> openings = find_face_openings(body);
  std::map<std::string, std::vector<Range>> groups;
  for (const TemplatePart& part : body.parts) {
    if (part.name == "body" || part.name == "lashes" || part.vertex_count == 0) continue;
    const bool oral = part.name == "upperTeeth" || part.name == "lowerTeeth" || part.name == "tongue";
    groups[oral ? "mouth" : part.name].push_back({part.first_vertex, part.first_vertex + part.vertex_count});
  }
  for (const auto& [name, parts] : groups) {
    const auto lids = std::find_if(openings.begin(), openings.end(),
                                   [&group = name](const FaceOpening& o) { return o.name == group; });
    const bool is_eye = name != "mouth" && lids != openings.end();
    const Similarity moved = motion_of(surroundings(*skin, parts, before, nearest_vertices * parts.size()), before,
                                       after, is_eye ? eye_change : most_change - 1.0);
    for (const Range& r : parts)
      for (int p = r.first; p < r.last; ++p) after[p] = moved * before[p];
    if (is_eye) seat_eye(*lids, parts.front(), moved.scale, before, after);
  }
  const LashBinding lashes(body, before);
  const std::vector<Eigen::Vector3d> motion = lashes.motion(before, after);
  for (std::size_t i = 0; i < motion.size(); ++i)
    after[lashes.first_vertex() + static_cast<int>(i)] =
        before[lashes.first_vertex() + static_cast<int>(i)] + motion[i];
}

LashBinding::LashBinding(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest) {
  const TemplatePart* lashes = body.part("lashes");
  for (const FaceOpening& opening : find_face_openings(body))
    if (body.part(opening.name) != nullptr)
      for (const auto* half : {&opening.upper, &opening.lower}) rim_.insert(rim_.end(), half->begin(), half->end());
  if (lashes == nullptr || rim_.empty()) return;
  first_ = lashes->first_vertex;
  constexpr double blur = 5e-4;  // metres; points of the rim nearer than this count alike
  weights_.resize(lashes->vertex_count, static_cast<Eigen::Index>(rim_.size()));
  for (Eigen::Index i = 0; i < weights_.rows(); ++i)
    for (Eigen::Index k = 0; k < weights_.cols(); ++k) {
      const double squared = (rest[first_ + i] - rest[rim_[static_cast<std::size_t>(k)]]).squaredNorm() + blur * blur;
      weights_(i, k) = 1.0 / (squared * squared);
    }
  for (Eigen::Index i = 0; i < weights_.rows(); ++i) weights_.row(i) /= weights_.row(i).sum();
}

std::vector<Eigen::Vector3d> LashBinding::motion(const std::vector<Eigen::Vector3d>& from,
                                                 const std::vector<Eigen::Vector3d>& to) const {
  Eigen::MatrixX3d moves(weights_.cols(), 3);
  for (Eigen::Index k = 0; k < weights_.cols(); ++k) {
    const int v = rim_[static_cast<std::size_t>(k)];
    moves.row(k) = (to[v] - from[v]).transpose();
  }
  const Eigen::MatrixX3d lashes = weights_ * moves;
  std::vector<Eigen::Vector3d> motion(static_cast<std::size_t>(weights_.rows()));
  for (std::size_t i = 0; i < motion.size(); ++i) motion[i] = lashes.row(static_cast<Eigen::Index>(i)).transpose();
  return motion;
}

}  // namespace gyre
