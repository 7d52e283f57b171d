// SPDX-License-Identifier: Apache-2.0
#include "offload/body/head_space.h"

#include "common/geometry/pose.h"
#include "common/mesh/closest_point.h"
#include "offload/body/smooth_field.h"
#include "offload/body/template_tools.h"

#include <Eigen/Dense>

namespace gyre {
namespace {

struct Pair {
  const char* landmark;  // of the template
  int point;             // of iBUG
};
constexpr std::array<Pair, 12> pairs = {{{"sellion", 27},
                                         {"noseTip", 30},
                                         {"noseBase", 33},
                                         {"chin", 8},
                                         {"leftEyeInner", 42},
                                         {"leftEyeOuter", 45},
                                         {"rightEyeInner", 39},
                                         {"rightEyeOuter", 36},
                                         {"leftMouthCorner", 54},
                                         {"rightMouthCorner", 48},
                                         {"upperLip", 51},
                                         {"lowerLip", 57}}};

// The most lateral vertex of an ear, on the side of `sign`.
int ear_tip(const FaceModel& face, double sign) {
  const auto& at = face.mesh.vertices;
  const double low = at[face.landmarks[48]].y(), high = at[face.landmarks[27]].y() + 0.03;
  int tip = face.landmarks[sign > 0 ? 16 : 0];
  for (std::size_t v = 0; v < at.size(); ++v)
    if (at[v].y() > low && at[v].y() < high && sign * at[v].x() > sign * at[tip].x()) tip = static_cast<int>(v);
  return tip;
}

std::vector<bool> on_boundary(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
      ++uses[{a, b}];
    }
  std::vector<bool> boundary(mesh.vertices.size(), false);
  for (const auto& [edge, count] : uses)
    if (count == 1) boundary[edge.first] = boundary[edge.second] = true;
  return boundary;
}

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

class HeadTransfer {
 public:
  HeadTransfer(const BodyTemplate& body, const FaceModel& face)
      : body_(body),
        face_(face),
        count_(static_cast<std::size_t>(body.parts[0].vertex_count)),
        triangles_(body.mesh.triangles.begin(), body.mesh.triangles.begin() + body.parts[0].triangle_count) {}

  Result<HeadSpace> run() {
    if (const auto ok = align(); !ok) return tl::unexpected(ok.error());
    measure_headness();
    const std::vector<Eigen::Vector3d> on_face = register_head();
    HeadSpace space;
    space.distance = distance_;
    space.matched = matched_share_;
    if (matched_share_ < 0.8 || distance_ > 2e-3)
      return fail("the face model's mean face does not fit the template's head");
    for (std::size_t p = 0; p < space.points.size(); ++p) space.points[p] = nearest_to(face_.landmarks[p], on_face);
    hand_over(on_face, space);
    return space;
  }

 private:
  // The outer vertex that came to lie nearest to a vertex of the face model.
  int nearest_to(int on_model, const std::vector<Eigen::Vector3d>& on_face) const {
    int nearest = -1;
    for (std::size_t v = 0; v < count_; ++v) {
      if (!active_[v] || body_.regions[v] == BodyRegion::inner) continue;
      const Eigen::Vector3d& to = placed_.vertices[on_model];
      if (nearest < 0 || (on_face[v] - to).squaredNorm() < (on_face[nearest] - to).squaredNorm())
        nearest = static_cast<int>(v);
    }
    return nearest;
  }

  Result<void> align() {
    std::vector<Eigen::Vector3d> to, from;
    for (const auto& [landmark, point] : pairs) {
      const auto found = body_.landmarks.find(landmark);
      if (found == body_.landmarks.end()) return fail("template without landmark '" + std::string(landmark) + "'");
      landmark_vertices_.push_back(found->second);
      landmark_targets_.push_back(face_.landmarks[point]);
    }
    for (const auto& [name, sign] : {std::pair("leftEar", 1.0), {"rightEar", -1.0}})
      if (const auto found = body_.landmarks.find(name); found != body_.landmarks.end()) {
        landmark_vertices_.push_back(found->second);
        landmark_targets_.push_back(ear_tip(face_, sign));
      }
    for (std::size_t i = 0; i < landmark_vertices_.size(); ++i) {
      to.push_back(body_.mesh.vertices[landmark_vertices_[i]]);
      from.push_back(face_.mesh.vertices[landmark_targets_[i]]);
    }
    const auto moved = align_points(to, from, false);
    if (!moved) return tl::unexpected(moved.error());
    body_from_face_ = *moved;
    placed_ = face_.mesh;
    for (Eigen::Vector3d& v : placed_.vertices) v = body_from_face_ * v;
    return {};
  }

  // How much a vertex belongs to the head, 1, and not to the trunk, 0; the neck lies between.
  void measure_headness() {
    const int neck = body_.joint_index("neck");
    headness_.assign(count_, 0);
    active_.assign(count_, false);
    for (std::size_t v = 0; v < count_; ++v) {
      double head = 0, throat = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const int joint = body_.skin[v].joint[k];
        const std::string& name = body_.joints[joint].name;
        if (joint == neck) throat += body_.skin[v].weight[k];
        if (name == "head" || name == "jaw" || name.ends_with("Eye")) head += body_.skin[v].weight[k];
      }
      headness_[v] = smooth_step(0.2, 0.9, head);
      active_[v] = head + throat > 0.05;
    }
  }

  struct Match {
    bool good = false;
    SurfacePoint on_face;
  };

  std::vector<Match> matches(const ClosestPoint& surface, const std::vector<bool>& boundary,
                             const std::vector<Eigen::Vector3d>& at, double reach) const {
    const std::vector<Eigen::Vector3d> normals = vertex_normals(at, triangles_);
    std::vector<Match> found(count_);
    constexpr double facing = 0.6;
    for (std::size_t v = 0; v < count_; ++v) {
      if (!active_[v] || body_.regions[v] == BodyRegion::inner) continue;
      const auto nearest = surface.nearest(at[v], reach);
      if (!nearest || nearest->normal.dot(normals[v]) < facing) continue;
      const Eigen::Vector3i& t = placed_.triangles[nearest->triangle];
      if (boundary[t[0]] || boundary[t[1]] || boundary[t[2]]) continue;
      found[v] = {true, *nearest};
    }
    return found;
  }

  // Positions of the template's head on the placed face.
  std::vector<Eigen::Vector3d> register_head() {
    const ClosestPoint surface(placed_);
    const std::vector<bool> boundary = on_boundary(placed_);
    const auto rows = static_cast<Eigen::Index>(count_);
    std::vector<Eigen::Vector3d> at(body_.mesh.vertices.begin(),
                                    body_.mesh.vertices.begin() + static_cast<std::ptrdiff_t>(count_));
    SmoothField field(count_, triangles_, active_);
    // Stiffness, what a landmark weighs, how far closest points are looked for (metres).
    struct Step {
      double stiffness, landmark, reach;
    };
    constexpr std::array<Step, 12> steps = {{{2000, 200, 0},
                                             {1000, 100, 0.03},
                                             {500, 50, 0.03},
                                             {200, 20, 0.025},
                                             {100, 10, 0.02},
                                             {50, 5, 0.02},
                                             {20, 2, 0.015},
                                             {10, 1, 0.015},
                                             {5, 0.5, 0.01},
                                             {2, 0.2, 0.01},
                                             {1, 0, 0.008},
                                             {0.5, 0, 0.008}}};
    for (const Step& step : steps) {
      Eigen::VectorXd weights = Eigen::VectorXd::Zero(rows);
      Eigen::MatrixXd values = Eigen::MatrixXd::Zero(rows, 3);
      const auto pull = [&](int v, const Eigen::Vector3d& target, double weight) {
        const Eigen::Vector3d wanted = target - body_.mesh.vertices[v];
        values.row(v) = (weights[v] * values.row(v) + weight * wanted.transpose()) / (weights[v] + weight);
        weights[v] += weight;
      };
      const std::vector<Match> found = matches(surface, boundary, at, step.reach);
      for (std::size_t v = 0; v < count_; ++v)
        if (found[v].good && headness_[v] > 0.05) pull(static_cast<int>(v), found[v].on_face.position, headness_[v]);
      if (step.landmark > 0)
        for (std::size_t i = 0; i < landmark_vertices_.size(); ++i)
          pull(landmark_vertices_[i], placed_.vertices[landmark_targets_[i]], step.landmark);
      field.factorise(weights, step.stiffness);
      const Eigen::MatrixXd moved = field.solve(values);
      for (std::size_t v = 0; v < count_; ++v)
        at[v] = body_.mesh.vertices[v] + moved.row(static_cast<Eigen::Index>(v)).transpose();
    }
    constexpr double close = 0.004;
    found_ = matches(surface, boundary, at, close);
    std::size_t face = 0, matched = 0, all = 0;
    double squares = 0;
    for (std::size_t v = 0; v < count_; ++v) {
      face += body_.regions[v] == BodyRegion::face;
      matched += body_.regions[v] == BodyRegion::face && found_[v].good;
      all += found_[v].good;
      if (found_[v].good) squares += found_[v].on_face.distance * found_[v].on_face.distance;
    }
    matched_share_ = face > 0 ? static_cast<double>(matched) / static_cast<double>(face) : 0;
    distance_ = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(all, 1)));
    return at;
  }

  void hand_over(const std::vector<Eigen::Vector3d>& on_face, HeadSpace& space) const {
    const auto rows = static_cast<Eigen::Index>(count_);
    // Matched vertices hold their value as far as they are head; towards the trunk zero is wanted.
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(rows);
    for (std::size_t v = 0; v < count_; ++v) {
      const double value = found_[v].good ? headness_[v] : 0;
      weights[static_cast<Eigen::Index>(v)] = value + 0.2 * (1 - headness_[v]);
    }
    constexpr double stiffness = 0.5;
    SmoothField field(count_, triangles_, active_);
    field.factorise(weights, stiffness);
    const auto faded = [&](Eigen::MatrixXd values) {
      for (std::size_t v = 0; v < count_; ++v) {
        const auto row = static_cast<Eigen::Index>(v);
        const double value = found_[v].good ? headness_[v] : 0;
        values.row(row) *= weights[row] > 0 ? value / weights[row] : 0.0;
      }
      return field.solve(values);
    };
    const std::vector<Carrier> carriers = make_carriers();
    const std::vector<std::pair<int, std::vector<int>>> lashes = lash_roots();
    const auto add = [&](const std::string& name, const Eigen::MatrixXd& surface) {
      Eigen::MatrixXd offsets = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(body_.mesh.vertices.size()), 3);
      offsets.topRows(rows) = surface;
      for (const Carrier& carrier : carriers) carry(carrier, offsets);
      for (const auto& [v, near] : lashes) {
        offsets.row(v).setZero();
        for (int n : near) offsets.row(v) += offsets.row(n) / static_cast<double>(near.size());
      }
      constexpr double least = 2e-5;  // metres
      space.components.push_back(sparse_morph(name, offsets, least));
    };
    Eigen::MatrixXd values(rows, 3);
    for (std::size_t v = 0; v < count_; ++v)
      values.row(static_cast<Eigen::Index>(v)) = (on_face[v] - body_.mesh.vertices[v]).transpose();
    add("headMean", faded(values));
    for (std::size_t k = 0; k < face_.modes.size(); ++k) {
      values.setZero();
      for (std::size_t v = 0; v < count_; ++v) {
        if (!found_[v].good) continue;
        const SurfacePoint& p = found_[v].on_face;
        const Eigen::Vector3i& t = placed_.triangles[p.triangle];
        const Eigen::Vector3d bary(1 - p.weights.sum(), p.weights[0], p.weights[1]);
        Eigen::Vector3d offset = Eigen::Vector3d::Zero();
        for (int c = 0; c < 3; ++c) offset += bary[c] * face_.modes[k].col(t[c]).cast<double>();
        values.row(static_cast<Eigen::Index>(v)) = (body_from_face_.rotation * offset).transpose();
      }
      add("head" + std::to_string(k), faded(values));
    }
  }

  // A part inside the head and the body's vertices around it.
  struct Carrier {
    int first = 0, count = 0;
    std::vector<int> around;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::MatrixXd solve;  // 7 x 3 around: linear similarity (shift, turn, growth) from offsets
  };

  std::vector<Carrier> make_carriers() const {
    std::vector<Carrier> carriers;
    for (std::size_t p = 1; p < body_.parts.size(); ++p) {
      const TemplatePart& part = body_.parts[p];
      Carrier carrier;
      carrier.first = part.first_vertex;
      carrier.count = part.vertex_count;
      std::vector<std::pair<double, int>> near;
      for (std::size_t v = 0; v < count_; ++v) {
        if (!active_[v]) continue;
        double best = std::numeric_limits<double>::infinity();
        for (int i = 0; i < part.vertex_count; i += 4)
          best = std::min(best, (body_.mesh.vertices[v] - body_.mesh.vertices[part.first_vertex + i]).squaredNorm());
        near.emplace_back(best, static_cast<int>(v));
      }
      constexpr std::size_t neighbours = 80;
      std::sort(near.begin(), near.end());
      near.resize(std::min(near.size(), neighbours));
      for (const auto& [distance, v] : near) {
        carrier.around.push_back(v);
        carrier.centre += body_.mesh.vertices[v] / static_cast<double>(near.size());
      }
      Eigen::MatrixXd motion(3 * carrier.around.size(), 7);
      for (std::size_t i = 0; i < carrier.around.size(); ++i)
        motion.middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
            motion_at(body_.mesh.vertices[carrier.around[i]] - carrier.centre);
      carrier.solve = motion.completeOrthogonalDecomposition().pseudoInverse();
      carriers.push_back(std::move(carrier));
    }
    return carriers;
  }

  // Lashes grow on both eyes: each of their vertices goes with the lid beside it.
  std::vector<std::pair<int, std::vector<int>>> lash_roots() const {
    std::vector<std::pair<int, std::vector<int>>> roots;
    const TemplatePart* part = body_.part("lashes");
    if (!part) return roots;
    std::vector<int> outer;
    for (std::size_t v = 0; v < count_; ++v)
      if (active_[v] && body_.regions[v] != BodyRegion::inner) outer.push_back(static_cast<int>(v));
    constexpr std::size_t neighbours = 3;
    for (int v = part->first_vertex; v < part->first_vertex + part->vertex_count; ++v) {
      const auto nearer = [&](int a, int b) {
        return (body_.mesh.vertices[a] - body_.mesh.vertices[v]).squaredNorm() <
               (body_.mesh.vertices[b] - body_.mesh.vertices[v]).squaredNorm();
      };
      std::vector<int> near(std::min(neighbours, outer.size()));
      std::partial_sort_copy(outer.begin(), outer.end(), near.begin(), near.end(), nearer);
      roots.emplace_back(v, std::move(near));
    }
    return roots;
  }

  // Offsets of a point at r from the centre by shift, turn and growth.
  static Eigen::Matrix<double, 3, 7> motion_at(const Eigen::Vector3d& r) {
    Eigen::Matrix<double, 3, 7> motion;
    motion << 1, 0, 0, 0, r.z(), -r.y(), r.x(), 0, 1, 0, -r.z(), 0, r.x(), r.y(), 0, 0, 1, r.y(), -r.x(), 0, r.z();
    return motion;
  }

  void carry(const Carrier& carrier, Eigen::MatrixXd& offsets) const {
    Eigen::VectorXd around(3 * carrier.around.size());
    for (std::size_t i = 0; i < carrier.around.size(); ++i)
      around.segment<3>(3 * static_cast<Eigen::Index>(i)) = offsets.row(carrier.around[i]).transpose();
    const Eigen::VectorXd similarity = carrier.solve * around;
    for (int v = carrier.first; v < carrier.first + carrier.count; ++v)
      offsets.row(v) = (motion_at(body_.mesh.vertices[v] - carrier.centre) * similarity).transpose();
  }

  const BodyTemplate& body_;
  const FaceModel& face_;
  std::size_t count_;  // of body vertices
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<int> landmark_vertices_, landmark_targets_;
  Similarity body_from_face_;
  TriangleMesh placed_;  // the mean face where the template's head is
  std::vector<double> headness_;
  std::vector<bool> active_;
  std::vector<Match> found_;
  double distance_ = 0, matched_share_ = 0;
};

}  // namespace

Result<HeadSpace> transfer_head_space(const BodyTemplate& body, const FaceModel& face) {
  return HeadTransfer(body, face).run();
}

}  // namespace gyre
