// SPDX-License-Identifier: Apache-2.0
// What this process takes of its machine.
#pragma once

namespace gyre {

// Of all its threads so far, user and system, seconds.
double processor_seconds();

// In memory now, bytes; 0 where the kernel does not tell.
double resident_bytes();

// The most there has been in memory, bytes, pages of shared libraries included; 0 where the kernel does not tell.
double peak_resident_bytes();

}  // namespace gyre
