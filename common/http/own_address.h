// SPDX-License-Identifier: Apache-2.0
// What this machine is called by others.
#pragma once

#include <string>

namespace gyre {

// The address from which this machine reaches other networks, else its host name, else "localhost". Sends nothing.
std::string own_address();

}  // namespace gyre
