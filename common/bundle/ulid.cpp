// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/ulid.h"

#include <sodium.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>

namespace gyre {

namespace {
constexpr std::string_view alphabet = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
}

std::string new_ulid() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  auto milliseconds = static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
  std::string text(26, '0');
  for (int i = 9; i >= 0; --i) {
    text[i] = alphabet[milliseconds & 31U];
    milliseconds >>= 5U;
  }
  std::array<unsigned char, 16> random{};
  randombytes_buf(random.data(), random.size());
  for (std::size_t i = 0; i < random.size(); ++i) text[10 + i] = alphabet[random[i] & 31U];
  return text;
}

bool is_ulid(std::string_view text) {
  return text.size() == 26 && text[0] <= '7' &&
         std::all_of(text.begin(), text.end(), [](char c) { return alphabet.find(c) != std::string_view::npos; });
}

}  // namespace gyre
