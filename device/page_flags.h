// SPDX-License-Identifier: Apache-2.0
// The flags that say where the rig's page is.
#pragma once

#include "common/http/http_server.h"
#include "common/http/listen_address.h"

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace gyre {

struct PageFlags {
  std::string page;  // ADDRESS:PORT; off: nowhere

  PageFlags();
  bool is_off() const { return page == "off"; }
};

void add_page_flags(CLI::App& verb, PageFlags& flags);

// How the daemon serves it. Who connects from elsewhere needs the token in the spool, which is made here on first
// use; the link that has it is then shown, once, when a terminal is there.
Result<HttpOptions> page_options(const PageFlags& flags, const std::filesystem::path& spool);

// The link for a phone, with the token. Errors: there is no spool yet, or the token cannot be read.
Result<std::string> page_url(const ListenAddress& page, const std::filesystem::path& spool);

}  // namespace gyre
