// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/picked_points.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>
#include <nlohmann/json.hpp>

// Any text is picked points, a set of landmarks or an error; what is read is written as something that reads the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (const auto points = gyre::picked_from_json(json)) {
    const nlohmann::json written = to_json(*points);
    const auto again = gyre::picked_from_json(written);
    if (!again || to_json(*again) != written) std::abort();
  }
  if (const auto set = gyre::landmarks_from_json(json)) {
    if (!gyre::landmarks_from_json(to_json(*set))) std::abort();
  }
  return 0;
}
