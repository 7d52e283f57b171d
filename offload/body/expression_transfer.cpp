// SPDX-License-Identifier: Apache-2.0
#include "offload/body/expression_transfer.h"

#include "offload/body/template_tools.h"

#include <cassert>
#include <limits>

namespace gyre {

namespace {

constexpr double least_offset = 1e-5;  // metres; less is not shape

std::vector<bool> moved_by_any(const BodyTemplate& body, std::size_t count) {
  std::vector<bool> moved(count, false);
  for (const Morph& expression : body.expressions)
    for (const int v : expression.vertices)
      if (static_cast<std::size_t>(v) < count) moved[v] = true;
  return moved;
}

std::span<const Eigen::Vector3i> skin_triangles(const BodyTemplate& body) {
  const TemplatePart* skin = body.part("body");
  if (skin == nullptr) return {};
  return {body.mesh.triangles.data() + skin->first_triangle, static_cast<std::size_t>(skin->triangle_count)};
}

// The face's similarity, of which the turn counts.
Eigen::Matrix3d turn_of_face(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest) {
  const std::vector<bool> moved = moved_by_any(body, body.mesh.vertices.size());
  std::vector<Eigen::Vector3d> from, to;
  for (std::size_t v = 0; v < moved.size(); ++v) {
    if (!moved[v]) continue;
    from.push_back(body.mesh.vertices[v]);
    to.push_back(rest[v]);
  }
  const auto found = align_points(to, from);
  return found ? found->rotation.toRotationMatrix() : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

DeformationTransfer skin_transfer(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest) {
  const TemplatePart* skin = body.part("body");
  std::vector<bool> movable = moved_by_any(body, rest.size());
  for (std::size_t v = 0; v < movable.size(); ++v)
    if (skin == nullptr || static_cast<int>(v) >= skin->first_vertex + skin->vertex_count) movable[v] = false;
  return {body.mesh.vertices, rest, skin_triangles(body), movable, turn_of_face(body, rest)};
}

// Skin around a part of the mouth, which the jaw carries as it carries the part.
std::vector<int> skin_around(const BodyTemplate& body, const TemplatePart& part, const std::vector<bool>& moved) {
  constexpr std::size_t most = 80;
  const auto& x = body.mesh.vertices;
  std::vector<std::pair<double, int>> nearest;
  for (int v = 0; v < body.part("body")->vertex_count; ++v) {
    if (!moved[v]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (int p = part.first_vertex; p < part.first_vertex + part.vertex_count; p += 7)
      least = std::min(least, (x[v] - x[p]).squaredNorm());
    nearest.emplace_back(least, v);
  }
  const std::size_t count = std::min(most, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(count), nearest.end());
  std::vector<int> around;
  for (std::size_t i = 0; i < count; ++i) around.push_back(nearest[i].second);
  return around;
}

Eigen::Vector3d mean_of(const std::vector<int>& vertices, const std::vector<Eigen::Vector3d>& offsets) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int v : vertices) sum += offsets[v];
  return sum / std::max<double>(1.0, static_cast<double>(vertices.size()));
}

std::vector<Eigen::Vector3d> sum_of(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  std::vector<Eigen::Vector3d> sum = a;
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] += b[v];
  return sum;
}

}  // namespace

ExpressionTransfer::ExpressionTransfer(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest)
    : body_(body),
      rest_(rest),
      skin_(skin_transfer(body, rest)),
      contacts_(body, rest),
      template_lashes_(body, body.mesh.vertices),
      lashes_(body, rest) {
  assert(rest.size() == body.mesh.vertices.size());
  const std::vector<bool> moved = moved_by_any(body, rest.size());
  for (const TemplatePart& part : body.parts) {
    if (part.name == "body" || part.vertex_count == 0) continue;
    const auto begin = static_cast<std::ptrdiff_t>(part.first_vertex);
    const std::vector<Eigen::Vector3d> from(body.mesh.vertices.begin() + begin,
                                            body.mesh.vertices.begin() + begin + part.vertex_count);
    const std::vector<Eigen::Vector3d> to(rest.begin() + begin, rest.begin() + begin + part.vertex_count);
    if (const auto found = align_points(to, from)) person_from_template_[part.name] = *found;
    const bool moves = std::any_of(moved.begin() + begin, moved.begin() + begin + part.vertex_count, std::identity());
    const bool turns_in_place =
        std::any_of(body.joints.begin(), body.joints.end(), [&](const Joint& j) { return j.name == part.name; });
    if (moves && !turns_in_place && part.name != "lashes") carriers_[part.name] = skin_around(body, part, moved);
  }
}

ExpressionTransfer::Points ExpressionTransfer::inner_offsets(const Points& template_offsets,
                                                             const Points& skin_offsets) const {
  Points offsets = skin_offsets;
  for (const TemplatePart& part : body_.parts) {
    const auto found = person_from_template_.find(part.name);
    if (found == person_from_template_.end()) continue;
    const Similarity& placed = found->second;
    double reach = placed.scale;
    if (const auto carriers = carriers_.find(part.name); carriers != carriers_.end()) {
      // As far as the skin around it goes against the template's, where that goes anywhere.
      constexpr double still = 1e-3;  // metres
      const Eigen::Vector3d wanted = placed.rotation * mean_of(carriers->second, template_offsets);
      const Eigen::Vector3d given = mean_of(carriers->second, skin_offsets);
      reach = (given.dot(wanted) + placed.scale * still * still) / (wanted.squaredNorm() + still * still);
      reach = std::clamp(reach, 0.6 * placed.scale, 1.6 * placed.scale);
    }
    for (int v = part.first_vertex; v < part.first_vertex + part.vertex_count; ++v)
      offsets[v] = reach * (placed.rotation * template_offsets[v]);
  }
  return offsets;
}

std::string ExpressionTransfer::base_of(const std::string& expression) {
  return expression == "mouthClose" ? "jawOpen" : "";
}

std::vector<Morph> ExpressionTransfer::transfer() const {
  const std::size_t count = rest_.size();
  const auto expressions = static_cast<Eigen::Index>(body_.expressions.size());
  // What each expression looks like in use, on the template.
  std::vector<Points> looks;
  std::vector<Eigen::Index> base(body_.expressions.size(), -1);
  for (std::size_t e = 0; e < body_.expressions.size(); ++e) {
    Points look(count, Eigen::Vector3d::Zero());
    add_morph(look, body_.expressions[e], 1.0);
    const std::string name = base_of(body_.expressions[e].name);
    for (std::size_t b = 0; b < body_.expressions.size() && !name.empty(); ++b)
      if (body_.expressions[b].name == name) {
        base[e] = static_cast<Eigen::Index>(b);
        add_morph(look, body_.expressions[b], 1.0);
      }
    looks.push_back(std::move(look));
  }
  Eigen::MatrixXd source(static_cast<Eigen::Index>(count), 3 * expressions);
  for (std::size_t e = 0; e < looks.size(); ++e)
    for (std::size_t v = 0; v < count; ++v)
      source.block<1, 3>(static_cast<Eigen::Index>(v), 3 * static_cast<Eigen::Index>(e)) = looks[e][v].transpose();
  const Eigen::MatrixXd skin = skin_.transfer(source);

  std::vector<Points> persons;
  for (std::size_t e = 0; e < looks.size(); ++e) {
    Points offsets(count);
    for (std::size_t v = 0; v < count; ++v)
      offsets[v] = skin.block<1, 3>(static_cast<Eigen::Index>(v), 3 * static_cast<Eigen::Index>(e)).transpose();
    offsets = inner_offsets(looks[e], offsets);
    Points state = sum_of(rest_, offsets);
    const Points template_state = sum_of(body_.mesh.vertices, looks[e]);
    for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_.mend(i, state, template_state);
    const Points hang = lashes_.motion(rest_, state);
    const Points template_hang = template_lashes_.motion(body_.mesh.vertices, template_state);
    const auto first = static_cast<std::size_t>(lashes_.first_vertex());
    for (std::size_t i = 0; i < hang.size(); ++i) {
      const Similarity& placed = person_from_template_.at("lashes");
      const Eigen::Vector3d own = looks[e][first + i] - template_hang[i];
      state[first + i] = rest_[first + i] + hang[i] + placed.scale * (placed.rotation * own);
    }
    for (std::size_t v = 0; v < count; ++v) offsets[v] = state[v] - rest_[v];
    persons.push_back(std::move(offsets));
  }

  std::vector<Morph> morphs;
  for (std::size_t e = 0; e < persons.size(); ++e) {
    Eigen::MatrixXd offsets(static_cast<Eigen::Index>(count), 3);
    for (std::size_t v = 0; v < count; ++v) {
      const Eigen::Vector3d below = base[e] >= 0 ? persons[base[e]][v] : Eigen::Vector3d(Eigen::Vector3d::Zero());
      offsets.row(static_cast<Eigen::Index>(v)) = (persons[e][v] - below).transpose();
    }
    morphs.push_back(sparse_morph(body_.expressions[e].name, offsets, least_offset));
  }
  return morphs;
}

std::vector<Morph> transfer_expressions(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest) {
  return ExpressionTransfer(body, rest).transfer();
}

}  // namespace gyre
