// SPDX-License-Identifier: Apache-2.0
// NumPy .npz archives, as the template sources use them.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// Arrays by name. Those of several dimensions lie row by row; a reader knows the shapes it expects from the counts.
struct NpzArrays {
  std::map<std::string, std::vector<std::int32_t>> integers;  // of type |u1, <u2, <i2 or <i4, widened
  std::map<std::string, std::vector<float>> reals;            // of type <f4
};

// Reads a ZIP archive (stored or deflated members, no ZIP64) of .npy members in C order, named without the ".npy".
// Files are outside input: every size is checked, and a bad one is an error that names the member.
Result<NpzArrays> read_npz(const std::filesystem::path& file);

}  // namespace gyre
