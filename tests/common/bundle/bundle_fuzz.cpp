// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

// Any text is a scan, a frame record or an error; what is read is written as something that reads the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto id = gyre::parse_frame_name(text)) {
    if (gyre::frame_name(id->pass, id->index) != text) std::abort();
  }
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return 0;
  if (const auto scan = gyre::scan_from_json(json)) {
    const nlohmann::json written = to_json(*scan);
    const auto again = gyre::scan_from_json(written);
    if (!again || to_json(*again) != written) std::abort();
  }
  if (const auto record = gyre::frame_record_from_json(json)) {
    const nlohmann::json written = to_json(*record);
    const auto again = gyre::frame_record_from_json(written);
    if (!again || to_json(*again) != written) std::abort();
  }
  return 0;
}
