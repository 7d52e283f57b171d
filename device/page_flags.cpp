// SPDX-License-Identifier: Apache-2.0
#include "device/page_flags.h"

#include "common/http/own_address.h"
#include "common/http/page_options.h"
#include "common/http/token.h"
#include "device/page/device_page.h"
#include "device/page/page_link.h"
#include "device/verbs.h"

#include <spdlog/spdlog.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdio>

namespace gyre {

PageFlags::PageFlags() : page("0.0.0.0:" + std::to_string(device_page_port)) {}

void add_page_flags(CLI::App& verb, PageFlags& flags) {
  verb.add_option("--page", flags.page,
                  "where browsers find the rig's page, ADDRESS:PORT; off: nowhere. From another machine it takes the "
                  "link that `gyre-device status --link` shows")
      ->capture_default_str();
}

Result<HttpOptions> page_options(const PageFlags& flags, const std::filesystem::path& spool) {
  std::error_code error;
  const bool is_first = !std::filesystem::exists(page_token(spool), error);
  Result<HttpOptions> http = page_options(flags.page, page_token(spool));
  if (!http) return http;
  http->link_source = "as `gyre-device status --link` shows it on the rig";
  if (http->token.empty() || !is_first) return http;
  const Result<std::string> url = page_url({http->address, http->port}, spool);
  if (!url) return tl::unexpected(url.error());
  // Not into a log, which others may read.
  if (::isatty(STDERR_FILENO) == 1) {
    std::fprintf(stderr, "%s", page_link(*url).c_str());
  } else {
    spdlog::info("`gyre-device status --link` shows the link to the rig's page");
  }
  return http;
}

Result<std::string> page_url(const ListenAddress& page, const std::filesystem::path& spool) {
  std::string host = page.is_every() ? own_address() : page.address;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string url = "http://" + host + ":" + std::to_string(page.port) + "/";
  if (!page.is_open()) return url;
  const Result<std::string> token = read_or_make_token(page_token(spool));
  if (!token) return tl::unexpected(token.error());
  return url + "?token=" + *token;
}

}  // namespace gyre
