// SPDX-License-Identifier: Apache-2.0
// A parallel loop whose result cannot depend on the number of threads.
#pragma once

#include <cstddef>
#include <functional>

namespace gyre {

// Calls body(i) once for every i in [0, count) on up to `threads` threads (0: all cores) and waits for all of them.
// body must write only to data that belongs to i; results are combined by the caller in index order.
// The first exception thrown by a body is rethrown here after all threads have ended.
void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body);

}  // namespace gyre
