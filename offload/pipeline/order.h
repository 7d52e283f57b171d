// SPDX-License-Identifier: Apache-2.0
// How work that takes long learns that it is to end.
#pragma once

#include <functional>

namespace gyre {

enum class Order {
  go_on,
  pause,   // this program stops; what runs elsewhere may go on, and all of it continues with the next start
  cancel,  // nobody wants the result any more
};

// Asked by who works, several times a second; thereby it also shows that it lives.
using Ask = std::function<Order()>;

}  // namespace gyre
