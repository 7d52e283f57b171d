// SPDX-License-Identifier: Apache-2.0
// The one-time code of a pairing: read off one screen and typed at another, once.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gyre {

// Eight characters of Crockford's base 32, 40 bits.
constexpr std::size_t pairing_code_length = 8;

std::string new_pairing_code();

// As people read it: "K7QF-2M9X".
std::string spaced_pairing_code(std::string_view code);

// What was meant by what was typed: case, spaces and hyphens do not count, O is 0, I and L are 1. Empty when it cannot
// be a code.
std::string typed_pairing_code(std::string_view text);

}  // namespace gyre
