// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_client.h"

#include <httplib.h>

namespace gyre {

Result<std::optional<std::string>> http_get(const std::string& address, int port, const std::string& path,
                                            const std::string& token, std::chrono::milliseconds patience) {
  httplib::Client client(address, port);
  client.set_connection_timeout(patience);
  client.set_read_timeout(patience);
  if (!token.empty()) client.set_bearer_token_auth(token);
  const httplib::Result answer = client.Get(path);
  if (!answer) return std::nullopt;
  if (answer->status != 200) {
    return fail("the program there refuses to answer", address + ":" + std::to_string(port) + path,
                "another program may have the port");
  }
  return answer->body;
}

}  // namespace gyre
