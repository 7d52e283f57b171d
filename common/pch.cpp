// SPDX-License-Identifier: Apache-2.0
// Gives the shared precompiled header a target to belong to.
#include "common/pch.h"

namespace gyre {
extern const char* const version;
const char* const version = GYRE_VERSION;
}  // namespace gyre
