// SPDX-License-Identifier: Apache-2.0
// Parts of the face that one photograph has to show whole, because they move between photographs.
#pragma once

#include "offload/body/template.h"
#include "offload/texture/labelling.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// One a triangle of the template: 1 left eye, 2 right eye, 3 mouth, with the skin close around; 0 elsewhere, and
// everywhere on a template without these landmarks.
std::vector<std::uint8_t> face_features(const BodyTemplate& body);

// For every feature (1 and up, one a triangle), the photograph that shows most of it best becomes the only candidate
// of its triangles that this photograph sees at all; the others keep theirs.
void hold_to_one_view(const ObservationTable& table, std::span<const std::uint8_t> feature,
                      std::vector<std::vector<Candidate>>& candidates);

}  // namespace gyre
