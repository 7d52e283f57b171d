// SPDX-License-Identifier: Apache-2.0
#include "device/spool/spool.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

struct StatusFlags {
  std::string spool;
  bool json = false;
};

struct ScanStatus {
  std::string id;
  std::string phase;
  std::string reason;
  int files = 0;
  int acknowledged = 0;
};

ScanStatus status_of(const SpooledScan& scan) {
  ScanStatus status{scan.id, std::string(name_of(scan.phase)), scan.reason};
  for (const SpooledFile& file : scan.files) {
    if (file.phase == SpooledFilePhase::discarded) continue;
    ++status.files;
    if (file.phase == SpooledFilePhase::acknowledged) ++status.acknowledged;
  }
  return status;
}

int status(const StatusFlags& given) {
  if (!std::filesystem::exists(given.spool)) {
    return report_error(fail("no spool there", given.spool, "give --spool, or make a scan first").value());
  }
  const Result<std::unique_ptr<Spool>> spool = Spool::open(given.spool);
  if (!spool) return report_error(spool.error());
  nlohmann::json list = nlohmann::json::array();
  for (const std::string& id : (*spool)->scan_ids()) {
    const std::optional<SpooledScan> scan = (*spool)->scan(id);
    if (!scan) continue;
    const ScanStatus now = status_of(*scan);
    if (given.json) {
      list.push_back({{"scan", now.id},
                      {"state", now.phase},
                      {"reason", now.reason},
                      {"files", now.files},
                      {"acknowledged", now.acknowledged}});
    } else {
      std::printf("%s  %-12s  %d of %d files on the host%s%s\n", now.id.c_str(), now.phase.c_str(), now.acknowledged,
                  now.files, now.reason.empty() ? "" : ": ", now.reason.c_str());
    }
  }
  if (given.json) std::printf("%s\n", list.dump().c_str());
  return 0;
}

}  // namespace

void add_status_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<StatusFlags>();
  flags->spool = (data_folder() / "spool").string();
  CLI::App* verb = app.add_subcommand("status", "list the scans on this device and how far each has got");
  verb->add_option("--spool", flags->spool, "folder where scans are kept")->capture_default_str();
  verb->add_flag("--json", flags->json, "one JSON list instead of lines");
  verb->callback([flags, &run] { run = [flags] { return status(*flags); }; });
}

}  // namespace gyre
