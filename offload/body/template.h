// SPDX-License-Identifier: Apache-2.0
// The human template: one mesh with skin, shape space, expressions and landmarks, and how to evaluate it.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// Up to four joints that move a vertex; weights sum to 1, unused entries are joint 0 with weight 0.
struct SkinWeights {
  std::array<int, 4> joint{};
  std::array<float, 4> weight{};
};

// How far a joint turns from the rest pose: bounds of its rotation vector's components along three orthonormal axes.
struct JointRange {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, world: along the bone, bending forwards, sideways
  Eigen::Vector3d least = Eigen::Vector3d::Constant(-3.2), most = Eigen::Vector3d::Constant(3.2);  // radians
};

// A joint named as VRM 1.0 names humanoid bones ("hips", "leftUpperArm", ...), in an order where parents come first.
struct Joint {
  std::string name;
  int parent = -1;  // -1: root
  // Rest position = sum of weight * vertex, so that it follows any shape.
  std::vector<std::pair<int, double>> regressor;
  JointRange range;
};

// Vertex offsets from the mean, metres. Sparse: entries for moved vertices only.
struct Morph {
  std::string name;
  std::vector<int> vertices;
  std::vector<Eigen::Vector3f> offsets;
};

// A connected part of the surface with its own role: "body", "leftEye", "rightEye", "upperTeeth", "lowerTeeth",
// "tongue", "lashes", ... Its vertices and triangles are contiguous.
struct TemplatePart {
  std::string name;
  int first_vertex = 0, vertex_count = 0;
  int first_triangle = 0, triangle_count = 0;
};

// What region of the body a vertex lies in, for weights of the fit and of the texture.
enum class BodyRegion : std::uint8_t {
  torso,
  head,
  face,
  left_arm,
  right_arm,
  left_hand,
  right_hand,
  left_leg,
  right_leg,
  left_foot,
  right_foot,
  inner
};

struct BodyTemplate {
  std::string name;       // "gyre-human 1", "built-in"
  std::string checksum;   // SHA-256 of the file; of the generator's version for the built-in one
  std::string notices;    // licences of what it was made from
  bool built_in = false;  // true: the generated stand-in without a face

  // Mean shape in the rest pose: metres, +Y up, facing +Z, soles on y = 0. Part "body" comes first.
  TriangleMesh mesh;  // vertices, triangles, uv, uv_triangles
  std::vector<TemplatePart> parts;
  std::vector<SkinWeights> skin;    // one a vertex
  std::vector<Joint> joints;        // the VRM humanoid bones
  std::vector<BodyRegion> regions;  // one a vertex
  std::vector<int> mirror;          // vertex -> its mirror vertex (itself on the midline), -1: none
  // What makes a person, in components of one standard deviation each: principal components of bodies, and what heads
  // differ in beyond them. The first head component may take the template's mean head to that of the others' origin.
  std::vector<Morph> shapes, head_shapes;
  std::map<std::string, Eigen::VectorXd> shape_means;  // of "female" and "male" people, in units of `shapes`
  std::vector<Morph> expressions;                      // names of ARKit, visemes
  std::map<std::string, int> landmarks;                // name -> vertex

  int joint_index(std::string_view joint) const;          // -1: none
  const TemplatePart* part(std::string_view part) const;  // nullptr: none
};

// Vertices of the rest pose for coefficients of `shapes` and `head_shapes` in standard deviations (missing ones are 0).
std::vector<Eigen::Vector3d> shaped_vertices(const BodyTemplate& body, const Eigen::VectorXd& shape,
                                             const Eigen::VectorXd& head = {});

// Rest position of every joint for the given rest vertices.
std::vector<Eigen::Vector3d> joint_positions(const BodyTemplate& body,
                                             const std::vector<Eigen::Vector3d>& rest_vertices);

// A pose: root translation and one rotation vector (axis times angle, radians, in the axes of the rest pose, which are
// the world's) a joint, applied about the joint's rest position and inherited by its children.
struct BodyPose {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> rotations;
};

// Per joint: posed_from_rest.
std::vector<Eigen::Affine3d> joint_transforms(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_joints,
                                              const BodyPose& pose);

// Linear blend skinning of rest vertices.
std::vector<Eigen::Vector3d> skin_vertices(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                                           const std::vector<Eigen::Affine3d>& posed_from_rest);

// Inverse of skin_vertices: each vertex by the inverse of its blended matrix.
std::vector<Eigen::Vector3d> unskin_vertices(const BodyTemplate& body,
                                             const std::vector<Eigen::Vector3d>& posed_vertices,
                                             const std::vector<Eigen::Affine3d>& posed_from_rest);

// Adds weight * morph to the vertices.
void add_morph(std::vector<Eigen::Vector3d>& vertices, const Morph& morph, double weight);

// The same for several, with one weight each (missing ones are 0).
void add_morphs(std::vector<Eigen::Vector3d>& vertices, const std::vector<Morph>& morphs,
                const Eigen::VectorXd& weights);

// Reads a packed template (GLB, its form is described in template_file.h); every index is checked, and the checksum it
// carries. The error says what is missing or damaged.
Result<BodyTemplate> read_template(const std::filesystem::path& file);
Result<void> write_template(const BodyTemplate& body, const std::filesystem::path& file);

// The generated stand-in: a closed mesh with the same bone names, UV, weights, a few shape components, no face rig.
BodyTemplate built_in_template();

// Looks in `given` (when not empty), $GYRE_TEMPLATE, the user's data folder ($XDG_DATA_HOME/gyre/template.glb) and the
// system's (/usr/share/gyre/template.glb), in this order; an empty path when there is none. A `given` or $GYRE_TEMPLATE
// that does not exist is an error.
Result<std::filesystem::path> find_template_file(const std::filesystem::path& given);

// Reads that file; the built-in human, with a warning in the log, when there is none.
Result<BodyTemplate> find_template(const std::filesystem::path& given);

}  // namespace gyre
