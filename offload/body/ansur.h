// SPDX-License-Identifier: Apache-2.0
// Body measures of the people of the ANSUR II survey, for both sexes.
#pragma once

#include "common/result/result.h"

#include <array>
#include <filesystem>
#include <vector>

namespace gyre {

// One person, metres. Definitions: Gordon et al., "2012 Anthropometric Survey of U.S. Army Personnel" (2014).
struct Person {
  double stature = 0, waist = 0, chest = 0, buttock = 0;  // standing height; three girths
};

struct Survey {
  struct Sex {
    std::vector<Person> people;
    Person lowest, highest;  // 1st and 99th percentile of each measure
    double mean_stature = 0;
  };
  Sex female, male;
};

// Reads the two tables of `folder`. An error names the file and the line.
Result<Survey> read_survey(const std::filesystem::path& folder);

}  // namespace gyre
