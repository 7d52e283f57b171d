// SPDX-License-Identifier: Apache-2.0
// How a phone gets to the page for the first time.
#pragma once

#include <string>

namespace gyre {

// For a terminal: the address as QR code and as text. It has the token in it, for whoever can read the terminal.
std::string page_link(const std::string& url);

}  // namespace gyre
