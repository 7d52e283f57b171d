// SPDX-License-Identifier: Apache-2.0
// What is known of the subject's landmarks and of its facing, in plain words.
#pragma once

#include "offload/body/landmark_set.h"

#include <string>
#include <vector>

namespace gyre {

// "leftEyeInner" is "left eye inner"; letters only.
std::string plain_name(const std::string& landmark);

// How many landmarks were placed by what; which way the subject faces and why; then what is missing, one sentence a
// reason.
std::vector<std::string> landmark_sentences(const LandmarkSet& set);

}  // namespace gyre
