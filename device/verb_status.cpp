// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_client.h"
#include "common/http/listen_address.h"
#include "common/http/token.h"
#include "device/page/page_link.h"
#include "device/page/scan_rows.h"
#include "device/page/status_text.h"
#include "device/page_flags.h"
#include "device/spool/spool.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;

struct StatusFlags {
  std::string spool = (data_folder() / "spool").string();
  std::string page = PageFlags().page;
  bool as_json = false;
  bool link = false;
};

// What the daemon says at that path; null when there is none.
Result<json> ask_daemon(const StatusFlags& given, const ListenAddress& page, const std::string& path) {
  constexpr std::chrono::seconds patience{5};
  std::string token;
  if (page.is_open() && !page.is_every()) {
    Result<std::string> kept = read_or_make_token(page_token(given.spool));
    if (!kept) return tl::unexpected(kept.error());
    token = std::move(*kept);
  }
  const Result<std::optional<std::string>> answer =
      http_get(page.is_every() ? "127.0.0.1" : page.address, page.port, path, token, patience);
  if (!answer) return tl::unexpected(answer.error());
  return *answer ? json::parse(**answer, nullptr, false) : json();
}

Result<json> read_spool(const StatusFlags& given) {
  if (!std::filesystem::exists(given.spool)) {
    return fail("no spool there", given.spool, "give --spool, or make a scan first");
  }
  const Result<std::unique_ptr<Spool>> spool = Spool::open(given.spool);
  if (!spool) return tl::unexpected(spool.error());
  return scan_rows(**spool, LiveStatus());
}

int status(const StatusFlags& given) {
  const bool is_off = given.page == "off";
  const Result<ListenAddress> page = parse_listen_address(is_off ? PageFlags().page : given.page);
  if (!page) return report_error(page.error());
  if (given.link) {
    const Result<std::string> url = page_url(*page, given.spool);
    if (!url) return report_error(url.error());
    std::printf("%s", page_link(*url).c_str());
    return 0;
  }
  const Result<json> live = is_off ? Result<json>(json()) : ask_daemon(given, *page, "/api/status");
  if (!live) return report_error(live.error());
  const Result<json> scans = live->is_object() ? ask_daemon(given, *page, "/api/scans") : read_spool(given);
  if (!scans) return report_error(scans.error());
  if (given.as_json) {
    std::printf("%s\n", json{{"rig", *live}, {"scans", *scans}}.dump().c_str());
  } else {
    std::printf("%s", status_text(*live, *scans).c_str());
  }
  return 0;
}

}  // namespace

void add_status_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<StatusFlags>();
  CLI::App* verb = app.add_subcommand("status", "what the rig is doing, and how far each of its scans has got");
  verb->add_option("--page", flags->page,
                   "where the daemon serves its page, ADDRESS:PORT; it is asked there. off: nobody is")
      ->capture_default_str();
  verb->add_option("--spool", flags->spool,
                   "folder where scans are kept, read while no daemon runs, with the token of the page")
      ->capture_default_str();
  verb->add_flag("--json", flags->as_json, "one JSON object instead of a screen");
  verb->add_flag("--link", flags->link, "show the link to the page instead, as QR code and as text");
  verb->callback([flags, &run] { run = [flags] { return status(*flags); }; });
}

}  // namespace gyre
