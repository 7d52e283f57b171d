// SPDX-License-Identifier: Apache-2.0
// Lids and lips that touch without passing through each other, the eyeballs or the teeth.
#pragma once

#include "offload/body/face_openings.h"
#include "offload/body/smooth_correction.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// How the two sides of an opening lie to each other, metres.
struct ContactState {
  double crossing = 0.0;     // furthest that a point of one side lies beyond the other side
  double penetration = 0.0;  // furthest that the eyeball or the teeth stand out of the skin in front of them
  double widest_gap = 0.0;   // between the edges of the two sides
  double mean_gap = 0.0;     // signed
};

// Finds and mends contacts around the openings of one person's face. The two sides of an opening are height fields over
// the plane that the opening's axes `across` and `out` span: where both exist, the upper one must not lie below the
// lower one. Likewise skin that lies before the teeth or an eyeball in the template must do so on the person: near the
// rim seen along `out`, else from the eyeball's middle. What is wrong is mended by the smoothest motion of the
// surroundings (SmoothCorrection), in a few rounds because the conditions are linear and the contacts are not.
class FaceContacts {
 public:
  // rest: the whole template in the person's shape, metres, in any place and pose of the head.
  FaceContacts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest);

  std::size_t size() const { return sides_.size(); }
  const FaceOpening& opening(std::size_t i) const { return sides_[i].rim; }

  // How opening i stands in a deformed state of the whole template. template_state: the same deformation of the
  // template's mean shape, which says what belongs in front of what.
  ContactState measure(std::size_t i, const std::vector<Eigen::Vector3d>& state,
                       const std::vector<Eigen::Vector3d>& template_state) const;

  // Moves the body's vertices of a deformed state until opening i has no crossing and no penetration. Lids that meet in
  // template_state are drawn together.
  void mend(std::size_t i, std::vector<Eigen::Vector3d>& state,
            const std::vector<Eigen::Vector3d>& template_state) const;

 private:
  // A vertex of a side and how far it may lie beyond what it must stay clear of, metres.
  struct Watched {
    int vertex = 0;
    bool upper = false;
    double floor = 0.0;
    bool all_round = false;  // against an eyeball: seen from its middle and not along `out`
  };
  struct Sides {
    FaceOpening rim;                            // where the skin's texture ends ...
    FaceOpening edge;                           // ... and the ring of skin beside it, where lids meet
    OpeningFrame template_frame, frame;         // of the template's mean shape and of the person
    double template_gap = 0.0;                  // metres, mean between the edges
    std::vector<RimPair> closed;                // points of the edges that meet when the eye is shut
    std::vector<std::array<int, 2>> margin;     // rim vertices and the edge vertices beside them
    std::vector<Eigen::Vector3i> upper, lower;  // triangles beside the rim
    std::vector<Eigen::Vector3i> behind;        // of the eyeball or the teeth
    std::vector<Watched> against_other;         // vertices of one side that may meet the other
    std::vector<Watched> against_back;          // skin that may meet what is behind it; its floor is that at rest
    std::optional<SmoothCorrection> correction;
  };

  static Sides find_sides(const BodyTemplate& body, const FaceOpening& opening);
  static std::vector<Watched> before_back(const Sides& sides, const std::vector<Eigen::Vector3d>& template_state);
  static bool shuts(const Sides& sides, const std::vector<Eigen::Vector3d>& template_state);
  static std::vector<MotionCondition> conditions(const Sides& sides, const std::vector<Watched>& before_back,
                                                 const std::vector<Eigen::Vector3d>& state, bool shut);

  std::vector<Sides> sides_;
};

// Mends every opening of a face at rest, in any place and pose of the head; the whole template's vertices.
void settle_face(const BodyTemplate& body, std::vector<Eigen::Vector3d>& vertices);

}  // namespace gyre
