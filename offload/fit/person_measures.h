// SPDX-License-Identifier: Apache-2.0
// What a tailor would measure on the fitted person.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace gyre {

struct Measure {
  double value = 0.0;      // metres
  double deviation = 0.0;  // metres, standard
  double support = 0.0;    // share in [0, 1] of the surface it was taken from that the cloud shows
};

// Measures over whatever is worn, by name:
//
//   stature              floor to the top of the hair, as the person stood
//   stature_without_hair the same to the crown of the skull under the hair, which is placed by the face
//   chest, waist, hip    tape around the trunk at the nipples, at the navel, and at its widest between navel and crotch
//   inseam               soles to crotch
//   left_arm, right_arm  point of the shoulder over elbow to wrist, between the landmarks on the surface
//
// The first two are given, the others taken from the rest surface. A measure whose landmarks the template lacks is
// missing. The deviation adds up that of the surface (`surface`, metres, of a point seen by the cloud), of the scale
// (`scale`, relative) and, where the cloud has nothing, of people about the template: the less support, the more.
//
// rest: whole template, soles on y = 0. support: one a vertex, of NonrigidFit. stature, hair: metres; the skull ends
// `hair` below the hair, negative: not known.
std::map<std::string, Measure> measure_person(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest,
                                              const std::vector<double>& support, double surface, double scale,
                                              double stature, double hair);

}  // namespace gyre
