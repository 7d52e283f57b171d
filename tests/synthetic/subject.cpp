// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/subject.h"

#include "common/parallel/parallel.h"
#include "tests/synthetic/appearance.h"
#include "tests/synthetic/noise.h"
#include "tests/synthetic/surface_nets.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gyre::synthetic {

namespace {

using Eigen::Vector3d;

constexpr double design_stature = 1.70;

// A capsule whose radius changes along its axis; `depth` squeezes it along z.
struct Limb {
  Vector3d a, b;
  double ra, rb;
  Material material;
  double depth = 1.0;

  double distance(const Vector3d& p) const {
    const Vector3d flat(1, 1, 1 / depth);
    const Vector3d pa = (p - a).cwiseProduct(flat), ba = (b - a).cwiseProduct(flat);
    const double length = ba.squaredNorm();
    const double t = length > 0 ? std::clamp(pa.dot(ba) / length, 0.0, 1.0) : 0.0;
    return (pa - t * ba).norm() - (ra + t * (rb - ra));
  }
};

struct Ellipsoid {
  Vector3d centre, radii;
  Material material;

  double distance(const Vector3d& p) const {
    const Vector3d q = (p - centre).cwiseQuotient(radii);
    const double k = q.norm();
    const double slope = q.cwiseQuotient(radii).norm();
    return slope > 1e-9 ? k * (k - 1) / slope : -radii.minCoeff();  // first-order distance
  }
};

// The skeleton at the design stature, left side only where there are two.
struct Skeleton {
  Vector3d hips{0, 0.955, 0}, spine{0, 1.02, 0}, spine1{0, 1.10, 0}, spine2{0, 1.22, -0.005};
  Vector3d neck{0, 1.43, -0.005}, head{0, 1.51, 0.01}, head_end{0, 1.70, 0.01};
  Vector3d shoulder{0.03, 1.395, -0.01}, arm{0.165, 1.385, -0.01}, fore_arm{0.351, 1.163, -0.01},
      hand{0.508, 0.976, 0.042};
  Vector3d up_leg{0.09, 0.90, 0}, leg{0.112, 0.48, 0.012}, foot{0.127, 0.085, -0.02}, toe{0.135, 0.03, 0.11};
};

Vector3d mirrored(const Vector3d& p) {
  return {-p.x(), p.y(), p.z()};
}

class Person {
 public:
  explicit Person(const SubjectOptions& options) : folds_(options.folds), noise_(hash(options.seed, 11)) {
    const Skeleton s;
    const Vector3d palm = s.hand + 0.09 * (s.hand - s.fore_arm).normalized();
    const Vector3d tip = s.hand + 0.17 * (s.hand - s.fore_arm).normalized();
    limbs_ = {
        {{0, 0.93, 0}, {0, 1.04, 0}, 0.160, 0.142, Material::trousers, 0.74},
        {{0, 1.05, 0}, {0, 1.30, 0}, 0.148, 0.165, Material::sweater, 0.70},
        {{-0.135, 1.375, -0.01}, {0.135, 1.375, -0.01}, 0.067, 0.067, Material::sweater},
        {{0, 1.37, -0.01}, {0, 1.44, -0.005}, 0.085, 0.068, Material::sweater},
        {s.neck, {0, 1.52, 0.012}, 0.056, 0.054, Material::skin},
        {{0, 1.55, 0.03}, {0, 1.505, 0.068}, 0.062, 0.034, Material::face},
        {{0, 1.600, 0.108}, {0, 1.567, 0.126}, 0.008, 0.014, Material::face},
    };
    add_pair({s.arm, s.fore_arm, 0.056, 0.046, Material::sweater});
    add_pair({s.fore_arm, s.hand, 0.047, 0.038, Material::sweater});
    add_pair({s.hand, palm, 0.027, 0.030, Material::skin});
    add_pair({palm + Vector3d(0, 0, 0.016), tip + Vector3d(0, 0, 0.010), 0.019, 0.012, Material::skin});
    add_pair({palm - Vector3d(0, 0, 0.016), tip - Vector3d(0, 0, 0.012), 0.019, 0.011, Material::skin});
    add_pair({s.hand + Vector3d(0, 0, 0.02), palm + Vector3d(-0.015, -0.01, 0.05), 0.016, 0.011, Material::skin});
    add_pair({s.up_leg + Vector3d(0, -0.02, 0), s.leg, 0.092, 0.062, Material::trousers});
    add_pair({s.leg, s.leg + Vector3d(0.004, -0.12, -0.022), 0.060, 0.061, Material::trousers});
    add_pair({s.leg + Vector3d(0.004, -0.12, -0.022), s.foot + Vector3d(0, 0.02, 0), 0.061, 0.050, Material::trousers});
    add_pair({{0.127, 0.047, -0.045}, {0.138, 0.034, 0.145}, 0.044, 0.036, Material::shoe});
    ellipsoids_ = {
        {{0, 1.59, 0.02}, {0.076, 0.108, 0.095}, Material::face},
        {{0, 1.612, 0.004}, {0.086, 0.088, 0.102}, Material::hair},
        {{0, 1.575, -0.022}, {0.083, 0.080, 0.080}, Material::hair},
        {{0.077, 1.575, 0.008}, {0.012, 0.030, 0.019}, Material::skin},
        {{-0.077, 1.575, 0.008}, {0.012, 0.030, 0.019}, Material::skin},
    };
  }

  // Negative inside. Pieces of one kind melt into each other; a collar or hem keeps a visible edge.
  double distance(const Vector3d& p) const {
    double cloth = infinity, skin = infinity, hair = infinity;
    const auto add = [&](const auto& piece) {
      const double d = piece.distance(p);
      double& group = piece.material == Material::hair                                       ? hair
                      : piece.material == Material::skin || piece.material == Material::face ? skin
                                                                                             : cloth;
      group = smooth_min(group, d, piece.material == Material::shoe ? 0.008 : 0.022);
    };
    for (const Limb& limb : limbs_) add(limb);
    for (const Ellipsoid& ellipsoid : ellipsoids_) add(ellipsoid);
    if (std::abs(cloth) < 0.05 && p.y() > 0.1) {
      // Finer than a cell would alias in the mesh.
      cloth += folds_ * noise_.fractal(p.cast<float>(), 0.14f, 2, 0.5f, 0.005f);
    }
    const double body = smooth_min(smooth_min(cloth, skin, 0.004), hair, 0.004);
    return std::max(body, -p.y());  // flat soles
  }

  // Material of the piece nearest to a surface point.
  Material material(const Vector3d& p) const {
    double nearest = infinity;
    Material found = Material::skin;
    const auto add = [&](const auto& piece) {
      const double d = piece.distance(p);
      if (d >= nearest) return;
      nearest = d;
      found = piece.material;
    };
    for (const Limb& limb : limbs_) add(limb);
    for (const Ellipsoid& ellipsoid : ellipsoids_) add(ellipsoid);
    return found;
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  // Polynomial smooth minimum over a band of k metres.
  static double smooth_min(double a, double b, double k) {
    if (a == infinity || b == infinity) return std::min(a, b);
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - h * h * k / 4;
  }

  void add_pair(const Limb& left) {
    limbs_.push_back(left);
    Limb right = left;
    right.a = mirrored(left.a);
    right.b = mirrored(left.b);
    limbs_.push_back(right);
  }

  double folds_;
  Noise noise_;
  std::vector<Limb> limbs_;
  std::vector<Ellipsoid> ellipsoids_;
};

std::vector<NamedJoint> skeleton_joints(double scale) {
  const Skeleton s;
  std::vector<NamedJoint> joints = {{"Hips", "", s.hips},           {"Spine", "Hips", s.spine},
                                    {"Spine1", "Spine", s.spine1},  {"Spine2", "Spine1", s.spine2},
                                    {"Neck", "Spine2", s.neck},     {"Head", "Neck", s.head},
                                    {"HeadEnd", "Head", s.head_end}};
  for (const bool left : {true, false}) {
    const std::string side = left ? "Left" : "Right";
    const auto add = [&](const std::string& name, const std::string& parent, const Vector3d& p) {
      joints.push_back({side + name, parent, left ? p : mirrored(p)});
    };
    add("Shoulder", "Spine2", s.shoulder);
    add("Arm", side + "Shoulder", s.arm);
    add("ForeArm", side + "Arm", s.fore_arm);
    add("Hand", side + "ForeArm", s.hand);
    add("UpLeg", "Hips", s.up_leg);
    add("Leg", side + "UpLeg", s.leg);
    add("Foot", side + "Leg", s.foot);
    add("ToeBase", side + "Foot", s.toe);
  }
  for (NamedJoint& joint : joints) joint.position *= scale;
  return joints;
}

}  // namespace

Subject make_subject(const SubjectOptions& options) {
  const Person person(options);
  const double scale = options.stature / design_stature;
  const Eigen::AlignedBox3d box(Vector3d(-0.72, -0.03, -0.22), Vector3d(0.72, 1.76, 0.26));
  Subject subject;
  subject.mesh = polygonise([&](const Vector3d& p) { return person.distance(p); }, box, options.cell);
  TriangleMesh& mesh = subject.mesh;
  subject.materials.resize(mesh.triangles.size());
  std::vector<Material> at_vertex(mesh.vertices.size());
  parallel_for(mesh.vertices.size(), 0, [&](std::size_t i) { at_vertex[i] = person.material(mesh.vertices[i]); });
  parallel_for(mesh.triangles.size(), 0, [&](std::size_t i) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    subject.materials[i] = person.material((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
  });
  for (Vector3d& v : mesh.vertices) {
    v *= scale;
    subject.stature = std::max(subject.stature, v.y());
  }
  const Appearance appearance(options.seed, scale);
  mesh.colours.resize(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    mesh.colours[i] = encode_srgb(appearance.albedo(at_vertex[i], mesh.vertices[i].cast<float>(),
                                                    mesh.normals[i].cast<float>(), static_cast<float>(options.cell)));
  subject.joints = skeleton_joints(scale);
  return subject;
}

}  // namespace gyre::synthetic
