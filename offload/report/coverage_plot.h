// SPDX-License-Identifier: Apache-2.0
// What work/cloud/coverage.json says, for a person: the subject's surface unrolled as a grid, and its holes in words.
#pragma once

#include "offload/report/report_facts.h"

#include <string>
#include <vector>

namespace gyre {

// An inline SVG: one row a height, the head at the top; one column a side, the front in the middle and the subject's
// left at the right. Each cell shows how many views see it; holes are framed. Empty without coverage, or
// when the file makes no sense.
std::string coverage_grid(const ReportFacts& facts);

// One sentence a hole, the largest first: "Left side, knee height: hardly seen; no picture looks at it squarely."
// Neighbouring cells are one hole. Sides are named by their azimuth until the fit has found where the subject faces.
std::vector<std::string> hole_sentences(const ReportFacts& facts);

}  // namespace gyre
