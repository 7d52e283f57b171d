// SPDX-License-Identifier: Apache-2.0
// Body measures of the people of the ANSUR II survey, for both sexes.
#pragma once

#include "common/result/result.h"

#include <array>
#include <filesystem>
#include <string_view>
#include <vector>

namespace gyre {

// The measures that bodies are fitted to, by their column in the tables; metres. Definitions: Gordon et al., "2012
// Anthropometric Survey of U.S. Army Personnel" (2014).
inline constexpr std::array<std::string_view, 20> survey_measures = {"stature",
                                                                     "crotchheight",
                                                                     "kneeheightmidpatella",
                                                                     "cervicaleheight",
                                                                     "waistcircumference",
                                                                     "chestcircumference",
                                                                     "buttockcircumference",
                                                                     "waistdepth",
                                                                     "chestdepth",
                                                                     "hipbreadth",
                                                                     "neckcircumference",
                                                                     "thighcircumference",
                                                                     "lowerthighcircumference",
                                                                     "calfcircumference",
                                                                     "anklecircumference",
                                                                     "bicepscircumferenceflexed",
                                                                     "wristcircumference",
                                                                     "acromionradialelength",
                                                                     "radialestylionlength",
                                                                     "biacromialbreadth"};

// One of each of survey_measures, metres.
using Measures = std::array<double, survey_measures.size()>;

struct Person {
  Measures measures{};
  double age = 0;  // years
};

struct Survey {
  struct Sex {
    std::vector<Person> people;
    Measures mean{};
    Measures deviation{};  // standard deviation
  };
  Sex female, male;
};

// Reads the two tables of `folder`. An error names the file and the line.
Result<Survey> read_survey(const std::filesystem::path& folder);

}  // namespace gyre
