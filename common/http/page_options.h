// SPDX-License-Identifier: Apache-2.0
// How a page is served at the address the operator wrote.
#pragma once

#include "common/http/http_server.h"
#include "common/result/result.h"

#include <filesystem>
#include <string>

namespace gyre {

// address: ADDRESS:PORT. When other machines can connect there, they need the token in `token_file`, which is made on
// first use. Errors (wrong use): not an address; else what read_or_make_token says.
Result<HttpOptions> page_options(const std::string& address, const std::filesystem::path& token_file);

}  // namespace gyre
