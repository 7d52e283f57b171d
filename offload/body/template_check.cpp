// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template_check.h"

#include "offload/body/body_measures.h"
#include "offload/body/expression_check.h"
#include "offload/body/humanoid.h"
#include "offload/body/joint_range.h"
#include "offload/body/landmark_set.h"

#include <set>

namespace gyre {
namespace {

class Checker {
 public:
  explicit Checker(const BodyTemplate& body) : body_(body) {}

  std::vector<TemplateFinding> run() {
    if (!sizes()) return findings_;
    surface();
    weights();
    joints();
    mirror();
    atlas();
    shapes();
    expressions();
    landmarks();
    ranges();
    return findings_;
  }

 private:
  void error(const std::string& what) { add(true, what); }
  void note(const std::string& what) { add(false, what); }
  void add(bool is_error, const std::string& what) {
    findings_.emplace_back();
    findings_.back().is_error = is_error;
    findings_.back().what = what;
  }
  std::size_t vertex_count() const { return body_.mesh.vertices.size(); }
  bool in_range(int vertex) const { return vertex >= 0 && static_cast<std::size_t>(vertex) < vertex_count(); }

  bool sizes() {
    const std::size_t n = vertex_count();
    const TriangleMesh& mesh = body_.mesh;
    bool good = n > 0 && body_.skin.size() == n && body_.regions.size() == n && body_.mirror.size() == n &&
                mesh.uv_triangles.size() == mesh.triangles.size() && !body_.parts.empty();
    if (good && body_.parts[0].name != "body") good = false;
    for (const Eigen::Vector3i& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) good = good && in_range(t[k]);
    for (const Eigen::Vector3i& t : mesh.uv_triangles)
      for (int k = 0; k < 3; ++k) good = good && t[k] >= 0 && static_cast<std::size_t>(t[k]) < mesh.uv.size();
    for (const auto* morphs : {&body_.shapes, &body_.head_shapes, &body_.expressions})
      for (const Morph& morph : *morphs) {
        good = good && morph.vertices.size() == morph.offsets.size();
        for (int v : morph.vertices) good = good && in_range(v);
      }
    for (const Joint& joint : body_.joints)
      for (const auto& [v, weight] : joint.regressor) good = good && in_range(v);
    if (!good) error("arrays do not match each other");
    return good;
  }

  std::vector<Eigen::Vector3i> triangles_of(const TemplatePart& part) const {
    const auto first = body_.mesh.triangles.begin() + part.first_triangle;
    return {first, first + part.triangle_count};
  }

  void surface() {
    const EdgeReport edges = check_edges(triangles_of(body_.parts[0]));
    if (edges.open) error("body has " + std::to_string(edges.open) + " open edges");
    if (edges.crowded) error("body has " + std::to_string(edges.crowded) + " edges of more than two triangles");
    if (edges.flipped) error("body has " + std::to_string(edges.flipped) + " edges between triangles that face apart");
    if (edges.euler != 2) error("body's Euler characteristic is " + std::to_string(edges.euler) + ", not 2");
    const double metres = stature(body_.mesh.vertices, static_cast<std::size_t>(body_.parts[0].vertex_count));
    if (metres < 1.4 || metres > 2.1) error("stature is " + std::to_string(metres) + " m");
    double floor = std::numeric_limits<double>::infinity();
    for (const auto& v : body_.mesh.vertices) floor = std::min(floor, v.y());
    if (std::abs(floor) > 1e-3) error("soles are at y = " + std::to_string(floor) + " m");
  }

  void weights() {
    int bad = 0;
    for (const SkinWeights& skin : body_.skin) {
      float sum = 0;
      bool good = true;
      for (std::size_t k = 0; k < skin.joint.size(); ++k) {
        sum += skin.weight[k];
        good = good && skin.weight[k] >= 0 && skin.joint[k] >= 0 &&
               static_cast<std::size_t>(skin.joint[k]) < body_.joints.size();
      }
      if (!good || std::abs(sum - 1) > 1e-5F) ++bad;
    }
    if (bad) error(std::to_string(bad) + " vertices have skin weights that do not sum to 1");
  }

  void joints() {
    const auto& bones = humanoid_bones();
    for (const HumanoidBone& bone : bones)
      if (body_.joint_index(bone.name) < 0) error("no joint " + bone.name);
    for (std::size_t j = 0; j < body_.joints.size(); ++j)
      if (body_.joints[j].parent >= static_cast<int>(j))
        error("joint " + body_.joints[j].name + " comes before its parent");
    std::vector<Eigen::Vector3i> closed = triangles_of(body_.parts[0]);
    for (const char* eye : {"leftEye", "rightEye"})
      if (const TemplatePart* part = body_.part(eye)) {
        const auto more = triangles_of(*part);
        closed.insert(closed.end(), more.begin(), more.end());
      }
    const auto at = joint_positions(body_, body_.mesh.vertices);
    for (std::size_t j = 0; j < at.size(); ++j)
      if (winding_number(body_.mesh.vertices, closed, at[j]) < 0.5)
        error("joint " + body_.joints[j].name + " lies outside the body");
  }

  void mirror() {
    int missing = 0, broken = 0;
    double worst = 0;
    for (std::size_t v = 0; v < vertex_count(); ++v) {
      const int twin = body_.mirror[v];
      if (twin < 0) {
        ++missing;
      } else if (!in_range(twin) || body_.mirror[twin] != static_cast<int>(v)) {
        ++broken;
      } else {
        const Eigen::Vector3d& a = body_.mesh.vertices[v];
        const Eigen::Vector3d& b = body_.mesh.vertices[twin];
        worst = std::max(worst, (a - Eigen::Vector3d(-b.x(), b.y(), b.z())).norm());
      }
    }
    if (broken) error(std::to_string(broken) + " mirror pairs do not point at each other");
    if (worst > 5e-3) error("a mirror pair is " + std::to_string(1000 * worst) + " mm off");
    if (missing) note(std::to_string(missing) + " vertices have no mirror vertex");
  }

  void atlas() {
    for (const Eigen::Vector2d& uv : body_.mesh.uv)
      if (!(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1)) {
        error("a texture coordinate lies outside [0, 1]");
        return;
      }
    // A texel centre strictly inside two triangles is an overlap.
    constexpr int cells = 1024;
    constexpr double inside = 1e-6;
    std::vector<std::uint8_t> covered(static_cast<std::size_t>(cells) * cells, 0);
    std::size_t covered_once = 0, covered_twice = 0;
    for (const Eigen::Vector3i& t : body_.mesh.uv_triangles) {
      const Eigen::Vector2d a = body_.mesh.uv[t[0]] * cells, b = body_.mesh.uv[t[1]] * cells,
                            c = body_.mesh.uv[t[2]] * cells;
      const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
      if (std::abs(area) < 1e-9) continue;
      const Eigen::Vector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
      for (int y = static_cast<int>(low.y()); y <= std::min(cells - 1, static_cast<int>(high.y())); ++y)
        for (int x = static_cast<int>(low.x()); x <= std::min(cells - 1, static_cast<int>(high.x())); ++x) {
          const Eigen::Vector2d p = Eigen::Vector2d(x + 0.5, y + 0.5) - a;
          const double v = (p.x() * (c - a).y() - p.y() * (c - a).x()) / area;
          const double w = ((b - a).x() * p.y() - (b - a).y() * p.x()) / area;
          if (v < inside || w < inside || v + w > 1 - inside) continue;
          std::uint8_t& cell = covered[static_cast<std::size_t>(y) * cells + x];
          covered_once += cell == 0;
          covered_twice += cell == 1;
          cell = std::min(2, cell + 1);
        }
    }
    constexpr double tolerated = 2e-3;  // slivers where a chart folds
    const double share =
        static_cast<double>(covered_twice) / static_cast<double>(std::max<std::size_t>(covered_once, 1));
    if (share > tolerated)
      error("texture charts overlap on " + std::to_string(100 * share) + " % of the texels in use");
    if (share > 0 && share <= tolerated)
      note("texture charts overlap on " + std::to_string(covered_twice) + " of " + std::to_string(covered_once) +
           " texels");
  }

  void shapes() {
    if (body_.shapes.empty()) error("no shape components");
    for (const Morph& shape : body_.shapes)
      for (const auto& offset : shape.offsets)
        if (!(offset.norm() < 0.5F)) {
          error(shape.name + " moves a vertex by more than half a metre");
          break;
        }
  }

  void expressions() {
    if (body_.expressions.empty() && body_.built_in) {
      note("the built-in human has no face rig: no expressions, no visemes");
      return;
    }
    for (const std::string& fault : expression_faults(body_)) error(fault);
  }

  void landmarks() {
    for (const char* name : {"crown", "chin", "noseTip", "crotch", "leftShoulder", "rightShoulder", "leftElbow",
                             "rightElbow", "leftWrist", "rightWrist", "leftFingertip", "rightFingertip", "leftKnee",
                             "rightKnee", "leftHeel", "rightHeel", "leftToe", "rightToe"})
      if (!body_.landmarks.count(name)) error("no landmark " + std::string(name));
    std::string missing;
    for (const std::string& name : landmark_names())
      if (!body_.landmarks.count(name)) missing += (missing.empty() ? "" : ", ") + name;
    if (!missing.empty()) note("landmarks that are not there: " + missing);
    for (const auto& [name, vertex] : body_.landmarks) {
      const double x = in_range(vertex) ? body_.mesh.vertices[vertex].x() : std::nan("");
      if (std::isnan(x) || (name.starts_with("left") && x <= 0) || (name.starts_with("right") && x >= 0))
        error("landmark " + name + " is on the wrong side");
      if (!body_.mirror.empty() && in_range(vertex) && body_.landmarks.count(mirrored_name(name)) &&
          body_.mirror[vertex] >= 0 && body_.mirror[vertex] != body_.landmarks.at(mirrored_name(name)))
        note("landmark " + name + " is not where its other side's mirror is");
    }
  }

  // The rest pose must be possible, and people must not change what is not theirs.
  void ranges() {
    for (const Joint& joint : body_.joints)
      if (!beyond(joint.range, Eigen::Vector3d::Zero()).isZero())
        error("joint " + joint.name + " is beyond its range at rest");
    for (const Morph& shape : body_.head_shapes)
      for (int v : shape.vertices)
        if (body_.regions[v] != BodyRegion::head && body_.regions[v] != BodyRegion::face &&
            body_.regions[v] != BodyRegion::inner && body_.regions[v] != BodyRegion::torso) {
          error("head component " + shape.name + " moves a limb");
          break;
        }
    for (const auto& [sex, mean] : body_.shape_means)
      if (mean.size() > static_cast<Eigen::Index>(body_.shapes.size()) || !mean.allFinite() || mean.norm() > 10)
        error("mean of the " + sex + " people is no body");
  }

  const BodyTemplate& body_;
  std::vector<TemplateFinding> findings_;
};

}  // namespace

std::vector<TemplateFinding> check_template(const BodyTemplate& body) {
  return Checker(body).run();
}

EdgeReport check_edges(const std::vector<Eigen::Vector3i>& triangles) {
  std::map<std::pair<int, int>, std::pair<int, int>> uses;  // edge -> times along it, times against it
  std::set<int> vertices;
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      auto& use = uses[{std::min(a, b), std::max(a, b)}];
      ++(a < b ? use.first : use.second);
      vertices.insert(a);
    }
  EdgeReport report;
  for (const auto& [edge, use] : uses) {
    report.open += use.first + use.second == 1;
    report.crowded += use.first + use.second > 2;
    report.flipped += use.first == 2 || use.second == 2;
  }
  report.euler = static_cast<int>(vertices.size()) - static_cast<int>(uses.size()) + static_cast<int>(triangles.size());
  return report;
}

double winding_number(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles,
                      const Eigen::Vector3d& point) {
  constexpr double four_pi = 12.566370614359172;
  double angle = 0;
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::Vector3d a = vertices[t[0]] - point, b = vertices[t[1]] - point, c = vertices[t[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / four_pi;
}

}  // namespace gyre
