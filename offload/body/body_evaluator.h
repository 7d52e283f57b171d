// SPDX-License-Identifier: Apache-2.0
// Fast evaluation of the whole body from packed arrays.
#pragma once

#include "offload/body/body_state.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace gyre {

// Evaluates states of one template again and again. Offsets lie packed in 16 bits and sums are in single precision, so
// positions are exact to about 1e-5 m; evaluate() of body_state.h is the reference in double precision.
class BodyEvaluator {
 public:
  // body must outlive the evaluator.
  explicit BodyEvaluator(const BodyTemplate& body);

  // Posed vertices, 3 x n, metres; valid until the next call.
  const Eigen::Matrix3Xf& vertices(const BodyState& state);

  // Of the last state: rest vertices (3 x n), rest joints and posed_from_rest of each joint.
  const Eigen::Matrix3Xf& rest_vertices() const { return rest_; }
  const std::vector<Eigen::Vector3d>& rest_joints() const { return rest_joints_; }
  const std::vector<Eigen::Affine3d>& posed_from_rest() const { return posed_from_rest_; }

 private:
  // Morphs of one kind, in chunks of vertices that stay in the nearest cache while all morphs are summed. Offsets are
  // 16-bit steps, one length of step a morph: reading them is what takes the time.
  struct Block {
    std::vector<int> vertices;          // that any of the morphs moves
    std::vector<float> step;            // metres, one a morph
    std::vector<std::int16_t> offsets;  // by chunk, morph, vertex, axis; the last chunk is filled up with zeros
  };
  static Block pack(const std::vector<Morph>& morphs);
  void add(const Block& block, const Eigen::VectorXd& weights);

  struct Influence {
    std::array<std::uint16_t, 4> joint;
    std::array<float, 4> weight;
  };

  const BodyTemplate& body_;
  Eigen::VectorXf mean_;  // 3 a vertex
  Block shapes_, heads_, expressions_;
  std::vector<Influence> skin_;
  Eigen::Matrix3Xf rest_, posed_;
  std::vector<Eigen::Vector3d> rest_joints_;
  std::vector<Eigen::Affine3d> posed_from_rest_;
};

}  // namespace gyre
