// SPDX-License-Identifier: Apache-2.0
// Where a page is served, as the operator writes it.
#pragma once

#include "common/result/result.h"

#include <string>

namespace gyre {

struct ListenAddress {
  std::string address;  // without brackets
  int port = 0;         // 0: any free one

  bool is_open() const;   // other machines can connect
  bool is_every() const;  // all addresses of this machine are meant
};

// ADDRESS:PORT, with brackets around an address that has colons itself. Errors (wrong use): something else.
Result<ListenAddress> parse_listen_address(const std::string& text);

}  // namespace gyre
