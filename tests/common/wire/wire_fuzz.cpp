// SPDX-License-Identifier: Apache-2.0
#include "common/wire/wire.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>
#include <string_view>

// libFuzzer's entry. Any bytes decode to a message or an error; what decodes encodes to bytes that mean the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using gyre::wire::decode;
  using gyre::wire::encode;
  const auto message = decode(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!message) return 0;
  const std::string bytes = encode(*message);
  const auto again = decode(bytes);
  if (!again || again->index() != message->index() || encode(*again) != bytes) std::abort();
  return 0;
}
