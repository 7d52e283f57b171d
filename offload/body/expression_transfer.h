// SPDX-License-Identifier: Apache-2.0
// The template's expressions for one person's face.
#pragma once

#include "common/geometry/pose.h"
#include "offload/body/deformation_transfer.h"
#include "offload/body/face_contacts.h"
#include "offload/body/inner_parts.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// Carries expressions from the template's mean shape to a person of the same topology.
//
// The skin goes by deformation transfer. Then contacts are mended: lids and lips do not cross, eyeballs and teeth do
// not come through the skin, and eyes that the template closes are closed on the person, whatever the shape of the
// lids. Eyes, teeth and tongue take the template's motion turned and scaled as the part itself is; what the jaw carries
// goes as far as the person's mouth does. Lashes stay on the lids.
//
// An expression that undoes another (mouthClose shuts the lips of an opened jaw) is transferred and mended on top of
// that other one.
class ExpressionTransfer {
 public:
  // rest: the whole template in the person's shape and rest pose, metres, with inner parts in place.
  ExpressionTransfer(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest);

  // Offsets of the person's rest vertices for each expression of the template, in its order.
  std::vector<Morph> transfer() const;

  // The expression whose full strength `expression` is meant to be added to; empty: none.
  static std::string base_of(const std::string& expression);

 private:
  using Points = std::vector<Eigen::Vector3d>;
  Points inner_offsets(const Points& template_offsets, const Points& skin_offsets) const;

  const BodyTemplate& body_;
  Points rest_;
  DeformationTransfer skin_;
  FaceContacts contacts_;
  LashBinding template_lashes_, lashes_;
  std::map<std::string, Similarity> person_from_template_;  // by part
  std::map<std::string, std::vector<int>> carriers_;        // by part: skin whose motion says how far it goes
};

// The same without keeping anything.
std::vector<Morph> transfer_expressions(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest);

}  // namespace gyre
