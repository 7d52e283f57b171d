// SPDX-License-Identifier: Apache-2.0
// Drawings of where the cameras stood, as inline SVG.
#pragma once

#include "offload/report/report_facts.h"

#include <string>

namespace gyre {

// Seen from above: the subject faces down the page, its left is at the right, as in a plan seen by who stands before
// it. Empty without cameras.
std::string cameras_from_above(const ReportFacts& facts);

// Seen from the side, the floor at the bottom; distance from the subject's axis to the right.
std::string cameras_from_side(const ReportFacts& facts);

// Colour of a pass in drawings and captions.
std::string pass_colour(const std::string& pass);

}  // namespace gyre
