// SPDX-License-Identifier: Apache-2.0
#include "common/http/page_options.h"

#include "common/http/listen_address.h"
#include "common/http/token.h"

namespace gyre {

Result<HttpOptions> page_options(const std::string& address, const std::filesystem::path& token_file) {
  const Result<ListenAddress> where = parse_listen_address(address);
  if (!where) return tl::unexpected(where.error());
  HttpOptions options;
  options.address = where->address;
  options.port = where->port;
  if (!where->is_open()) return options;
  Result<std::string> token = read_or_make_token(token_file);
  if (!token) return tl::unexpected(token.error());
  options.token = std::move(*token);
  return options;
}

}  // namespace gyre
