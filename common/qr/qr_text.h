// SPDX-License-Identifier: Apache-2.0
// A QR code as text, for terminals.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// The modules of the QR code for `text` with the quiet zone of four modules around it, row by row; true: dark.
std::vector<std::vector<bool>> qr_modules(std::string_view text);

// The modules as lines of half blocks, two rows of modules a line, in black on white whatever the terminal's colours.
std::string qr_text(const std::vector<std::vector<bool>>& modules);

}  // namespace gyre
