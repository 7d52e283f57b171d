// SPDX-License-Identifier: Apache-2.0
// One well-formed message of every kind, for tests.
#pragma once

#include "common/wire/wire.h"

#include <vector>

namespace gyre::wire {

std::vector<Message> sample_messages();

}  // namespace gyre::wire
