// SPDX-License-Identifier: Apache-2.0
#include "common/keys/pairing_code.h"

#include <sodium.h>
#include <cctype>

namespace gyre {

namespace {

constexpr std::string_view alphabet = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";

}  // namespace

std::string new_pairing_code() {
  std::string code;
  while (code.size() < pairing_code_length) {
    code += alphabet[randombytes_uniform(static_cast<std::uint32_t>(alphabet.size()))];
  }
  return code;
}

std::string spaced_pairing_code(std::string_view code) {
  return std::string(code.substr(0, code.size() / 2)) + "-" + std::string(code.substr(code.size() / 2));
}

std::string typed_pairing_code(std::string_view text) {
  std::string code;
  for (const char typed : text) {
    if (typed == ' ' || typed == '-') continue;
    char c = static_cast<char>(std::toupper(static_cast<unsigned char>(typed)));
    if (c == 'O') c = '0';
    if (c == 'I' || c == 'L') c = '1';
    if (alphabet.find(c) == std::string_view::npos || code.size() == pairing_code_length) return {};
    code += c;
  }
  return code.size() == pairing_code_length ? code : std::string();
}

}  // namespace gyre
